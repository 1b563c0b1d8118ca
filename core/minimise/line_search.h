// The line search of Newton's method, by itself so that another one can take its place.
#pragma once

#include "iccm/core.h"

namespace iccm {

// A share of a step, the energy there, and whether it was accepted.
struct Trial {
    double share, energy;
    bool accepted;
};

// Backtrack: halve the share of a step until the energy there is low enough.
//
//   share      that is tried first
//   energy_at  the energy of a share of the step; infinite where that is not allowed
//   most       the most that the energy may be at a share
template <class EnergyAt, class Most>
Trial line_search(double share, EnergyAt energy_at, Most most) {
    constexpr double SHORTEST_STEP = 1e-8;  // share below which rounding decides (by hand)
    for (; share > SHORTEST_STEP; share *= 0.5) {
        double energy = energy_at(share);
        if (energy <= most(share)) return {share, energy, true};
    }
    return {share, 0.0, false};
}

}  // namespace iccm
