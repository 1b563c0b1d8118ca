// The line search with functions of the caller, for tests (tests/core/line_search.py).
#include "minimise/line_search.h"

using namespace iccm;

// Returns a number for a share of a step.
typedef double (*ShareCallback)(double share);

// The energy after a share of the step, and the largest one that is accepted there.
struct SearchedEnergy {
    ShareCallback energy_at;
    ShareCallback most;
};

// Search along a step. Returns the share that was accepted, 0 if none was.
//
//   share   first share to try
//   energy  (1,) the energy at the share, written
ICCM_EXPORT double iccm_minimise_line_search(const SearchedEnergy *searched, double share, double *energy) {
    Trial trial = line_search(share, searched->energy_at, searched->most);
    *energy = trial.energy;
    return trial.accepted ? trial.share : 0.0;
}
