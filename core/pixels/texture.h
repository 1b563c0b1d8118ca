// Location of points of the plane in a picture that lies in it.
#pragma once

#include "iccm/core.h"

namespace iccm {

// Two single-precision numbers as NumPy's complex64.
struct Complex64 {
    float re, im;
};

// The upper left corner of a picture in the plane, and the number of texels per unit, across and down.
struct Corner {
    double left, top, across, down;
};

// Texel coordinates of a point, x right and y down, and their derivatives with respect to the output's x and y: dx/dx,
// dx/dy, dy/dx, dy/dy.
struct Place {
    double x, y, xx, xy, yx, yy;
};

// `right` and `down` are complex numbers of either precision.
template <typename Slope>
inline Place place(Complex z, Slope right, Slope down, const Corner &corner) {
    return {(z.re - corner.left) * corner.across, (corner.top - z.im) * corner.down,
            right.re * corner.across,             down.re * corner.across,
            -right.im * corner.down,              -down.im * corner.down};
}

}  // namespace iccm
