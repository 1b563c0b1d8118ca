// Constants that the search shares with iccm, where they are explained. Written by `make generated`.

// iccm.linalg.fronts
export const LEAST_FRONT_VERTICES = 4;
export const MOST_ZEROS_SHARE = 0.2;

// iccm.linalg.ordering
export const FIRST_ENTRIES_PER_VERTEX = 16;

// iccm.pins
export const MOST_TOLERANCES = 3.0;
export const RADIUS_OUTLINE_DISTANCES = 1.2;
export const RADIUS_PIN_DISTANCES = 0.8;
export const RADIUS_SHARE = 0.15;
export const TOLERANCE_SHARE = 0.07;

// iccm.balanced.constraints.soft
export const COST_AT_TOLERANCE = 0.05;
export const STIFFNESS = 8.0;

// iccm.balanced.minimise.energy
export const BOTH_AREAS = 0.5;

// iccm.balanced.minimise.sliding
export const HELD = 0;
export const OUTLINE_WEIGHT = 0.02;
export const SLIDING = 1;

// iccm.balanced.minimise.soft_pins
export const CORE_MARGIN_RATIO = 1.3;
export const CORE_SHARE = 0.5;
export const FEWEST_CORE_VERTICES = 6;
export const LARGEST_CORE_RADIUS = 0.12;
export const WORST_CONDITION_NUMBER = 1000000.0;

// iccm.balanced.minimise.unfold
export const BARE = 1e-09;
export const RINGS = [2, 4, 8, 16];
export const LOCAL_STEPS = 100;
export const LOCAL_POLISHING = 30;

// iccm.balanced.minimise.untangle
export const DEEP = 0.16;
export const ENOUGH = 0.001;
export const LEAST_EPSILON = 1e-05;
export const LEAST_WEIGHT = 0.08;
export const PACE = 15;
export const POLISHED = 0.2;
export const SHRINK = 0.6;
export const SLOW = 0.003;
export const UNTANGLE_STEPS = 40;

// iccm.balanced.model.boundary_pairs
export const BOTH = 3;
export const MERGED_SPACING_SHARE = 0.35;
export const SOURCE = 1;
export const TARGET = 2;

// iccm.balanced.model.discrete_map
export const BADLY_STRETCHED = 25.0;
export const EASED = 0.01;
export const EASING_STEPS = 10;
export const FORWARD = 8;
export const GOOD_ENOUGH = 0.0005;
export const SETTLED = 0.001;
export const SMOOTHED_RINGS = 4;
export const SMOOTHINGS = 20;
export const LOCAL_SHARE = 0.5;

// iccm.balanced.model.energy
export const UPRIGHT = 2.0;

// iccm.balanced.model.mesh_sizes
export const GRID_CELLS_ACROSS = 40;
export const MOST_FINER_AT_PINS = 9.0;
export const MOST_MAGNIFIED = 6.0;
export const MOST_MORE_AT_PINS = 0.5;
export const TRIANGLES_A_RADIUS = 5.0;

// iccm.balanced.model.outline
export const SHARP_CORNER_RADIANS = 0.3490658503988659;

// iccm.balanced.model.outline_split
export const SAME_PLACE_SHARE = 1e-07;
export const SNAPPED_EDGE_SHARE = 0.35;

// iccm.balanced.search.candidates
export const ALIKE = [0.001, 0.017453292519943295];
export const CLOSE = 1.1;
export const FINALISTS = 2;
export const PROMISING_ENERGY_RATIO = 1.5;
export const RELEASE_GAIN_SHARE = 0.003;
export const RELEASE_ROUNDS = 3;
export const ROUNDS = 4;
export const SCREENING = [[3, 9], [5, 5]];
export const SETTLING = 2;

// iccm.balanced.search.final_mesh
export const AIMED_LIMITS = 0.95;
export const BLOCKED_ENERGY = 2.0;
export const BLOCKED_MISS = 0.95;
export const FINE_EXACTNESS = [0.0002, 0.0006];
export const LAST_DECREASE = 0.0002;
export const LAST_DECREASE_WITH_PINS = 1e-05;
export const LAST_ROUNDS = 4;
export const LAST_STEPS = 50;
export const MOST_STIFFENED = 10.0;
export const NARROW_AIM = 0.99;
export const STEEPEST_FINE = 20.0;
export const STIFFENINGS = 8;
export const TRIANGLES_PER_AREA = 4.6;

// iccm.balanced.search.initial_matches
export const ANY_TURN = [[0.0, 4], [1.5707963267948966, 2], [3.141592653589793, 2], [-1.5707963267948966, 2]];
export const ARCLENGTH_SHIFTS = 8;
export const CYCLIC_SHIFTS = 16;
export const DIFFERENT_MATCH_DISTANCE = 0.12;
export const MOST_TURNED = 1.7453292519943295;
export const OUTLINE_SAMPLES = 64;
export const POSITION_WEIGHT = 0.5;
export const TANGENT_CHORD_SHARE = 0.01;
export const TURNS = [[0.0, 5], [0.6, 2], [-0.6, 2]];
export const MATCH_STEPS = [[1, 1], [1, 2], [2, 1], [1, 3], [3, 1], [2, 3], [3, 2], [1, 4], [4, 1], [3, 4], [4, 3]];

// iccm.balanced.search.levels
export const BACKWARD_STEPS = 3;
export const FINE_BACKWARD = 4;
export const FINE_POWER = 3.0;
export const FINE_ROUNDS = 8;
export const MOST_PAIRS = 3000;
export const MOST_START_VERTICES = 12000;
export const PATIENT_STEPS = 200;
export const RELEASED_STEPS = 8;
export const SPACING_MESH_SIZES = 0.75;

// iccm.balanced.search.multilevel
export const COARSE_EXACTNESS = [0.0005, 0.006];
export const COARSE_MESH_SIZE = 0.1;
export const COARSE_SIZE_BY_LENGTH = 0.55;
export const FINE_MESH_SIZE = 0.05;
export const STEEPEST = 8.0;

// iccm.balanced.search.pin_continuation
export const TURNED_STARTS = 3;

// iccm.balanced.search.unit_problem
export const FINAL_TRIANGLES = 6000;

// iccm.io.edit.map_choice
export const AGREED_DIAGONAL_SHARE = 0.005;
export const MOST_POINTS_SHARE = 0.95;

// iccm.io.edit.session
export const STILL_SHARE = 0.0002;
