// The line search of Newton's method, separate so that it can be replaced.
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
//   share      first share to try
//   energy_at  the energy after a share of the step; infinite if that is not allowed
//   most       the largest accepted energy at a share; a constant where the map is moved and its energy may grow
//
// The caller keeps the positions of the last call of energy_at, so a search that returns an earlier share must
// evaluate it again.
template <class EnergyAt, class Most>
Trial line_search(double share, EnergyAt energy_at, Most most) {
    constexpr double SHORTEST_STEP = 1e-8;  // share below which rounding dominates
    for (; share > SHORTEST_STEP; share *= 0.5) {
        double energy = energy_at(share);
        if (energy <= most(share)) return {share, energy, true};
    }
    return {share, 0.0, false};
}

}  // namespace iccm
