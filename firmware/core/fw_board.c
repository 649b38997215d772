/* Whether a table of constants can belong to a device. */
#include "fw_parts.h"

enum { LEAST_TICK_US = 250, LARGEST_TICK_US = 10000 };

static const char *const SENTENCES[] = {
    "The table is possible.",
    "A number of the table is infinite or not a number: state all of them.",
    "tick_us is outside 250 to 10,000 us: choose one that the loop and the line keep.",
    "torque_limit is not above 0: state the largest torque at the blades in N m.",
    "force_limit is above 0 exactly where the board has ADVANCE_MOTOR: correct one of the two.",
    "opening_min is not below opening_max, or advance_min not below advance_max: state them in rad and "
    "m (both advance stops 0 without a carriage).",
    "opening_resolution or advance_resolution is not above 0 or wider than its range: state one encoder "
    "step in rad or m.",
    "handle_radius is not above 0: state the distance from the pivot to the hand in m.",
    "torque_slew or force_slew is not above 0: state how fast torque and force may change.",
    "overspeed is not above 0, or below the rate of one encoder step in a tick: raise it or take a "
    "finer encoder.",
    "opening_leap is not farther than the blades move in a tick at overspeed plus an encoder step, or "
    "advance_leap not above one step: raise it.",
    "torque_per_A or resistance is not above 0: take them from the motor's data, times or over the "
    "gear's ratio.",
    "torque_limit is above torque_per_A * supply_min / resistance, which is all that the supply can "
    "give: lower the limit or raise the supply.",
    "current_limit is below torque_limit / torque_per_A or current_continuous, or one of the limits "
    "on current is not above 0: make them agree.",
    "supply_min is not above 0, or supply_max is neither 0 nor above supply_min: state both in V.",
    "temperature_max is below 0: state it in degC, or 0 without a sensor.",
    "home_torque, home_speed, home_opening or home_timeout is impossible: home_torque within "
    "torque_limit and not 0, home_speed above 0 and below overspeed, home_opening within the stops, "
    "home_timeout above 0.",
};

static int all_finite(const fw_board *b)
{
    return fw_finite(b->torque_limit) && fw_finite(b->force_limit) && fw_finite(b->opening_min) &&
           fw_finite(b->opening_max) && fw_finite(b->advance_min) && fw_finite(b->advance_max) &&
           fw_finite(b->opening_resolution) && fw_finite(b->advance_resolution) &&
           fw_finite(b->handle_radius) && fw_finite(b->torque_slew) && fw_finite(b->force_slew) &&
           fw_finite(b->overspeed) && fw_finite(b->opening_leap) && fw_finite(b->advance_leap) &&
           fw_finite(b->torque_per_A) && fw_finite(b->resistance) && fw_finite(b->current_limit) &&
           fw_finite(b->current_continuous) && fw_finite(b->i2t_limit) &&
           fw_finite(b->supply_min) && fw_finite(b->supply_max) && fw_finite(b->temperature_max) &&
           fw_finite(b->home_torque) && fw_finite(b->home_speed) && fw_finite(b->home_opening) &&
           fw_finite(b->home_timeout);
}

static int motion_problem(const fw_board *b)
{
    const float tick_s = 1e-6f * (float)b->tick_us;
    const float opening = b->opening_max - b->opening_min;
    const float advance = b->advance_max - b->advance_min;
    const int slides = (b->capabilities & SC_CAPABILITY_ADVANCE_MOTOR) != 0;
    if (!(opening > 0.0f) || advance < 0.0f || (slides && advance == 0.0f) ||
        (advance == 0.0f && b->advance_min != 0.0f)) {
        return FW_BOARD_STOPS;
    }
    if (!(b->opening_resolution > 0.0f && b->opening_resolution < opening) ||
        (advance > 0.0f && !(b->advance_resolution > 0.0f && b->advance_resolution < advance))) {
        return FW_BOARD_RESOLUTION;
    }
    if (!(b->handle_radius > 0.0f)) {
        return FW_BOARD_HANDLE_RADIUS;
    }
    if (!(b->torque_slew > 0.0f) || (slides && !(b->force_slew > 0.0f))) {
        return FW_BOARD_SLEW;
    }
    if (!(b->overspeed > 0.0f && b->opening_resolution <= b->overspeed * tick_s)) {
        return FW_BOARD_OVERSPEED;
    }
    if (!(b->opening_leap > b->overspeed * tick_s + b->opening_resolution) ||
        (advance > 0.0f && !(b->advance_leap > b->advance_resolution))) {
        return FW_BOARD_LEAP;
    }
    return FW_BOARD_POSSIBLE;
}

static int power_problem(const fw_board *b)
{
    if (!(b->torque_per_A > 0.0f && b->resistance > 0.0f)) {
        return FW_BOARD_MOTOR;
    }
    if (!(b->supply_min > 0.0f) ||
        (b->supply_max != 0.0f && !(b->supply_max > b->supply_min))) {
        return FW_BOARD_SUPPLY;
    }
    if (b->torque_limit > b->torque_per_A * b->supply_min / b->resistance) {
        return FW_BOARD_BEYOND_SUPPLY;
    }
    if (!(b->current_continuous > 0.0f && b->i2t_limit > 0.0f) ||
        b->current_limit < b->current_continuous ||
        b->current_limit < b->torque_limit / b->torque_per_A) {
        return FW_BOARD_CURRENT;
    }
    return b->temperature_max < 0.0f ? FW_BOARD_TEMPERATURE : FW_BOARD_POSSIBLE;
}

static int home_problem(const fw_board *b)
{
    const float torque = fw_magnitude(b->home_torque);
    if ((b->capabilities & SC_CAPABILITY_HOMES) == 0) {
        return FW_BOARD_POSSIBLE;
    }
    return torque > 0.0f && torque <= b->torque_limit && b->home_speed > 0.0f &&
                   b->home_speed < b->overspeed && b->home_timeout > 0.0f &&
                   b->home_opening >= b->opening_min && b->home_opening <= b->opening_max
               ? FW_BOARD_POSSIBLE
               : FW_BOARD_HOME;
}

static int problem_of(const fw_board *b)
{
    if (!all_finite(b)) {
        return FW_BOARD_NOT_FINITE;
    }
    if (b->tick_us < LEAST_TICK_US || b->tick_us > LARGEST_TICK_US) {
        return FW_BOARD_TICK;
    }
    if (!(b->torque_limit > 0.0f)) {
        return FW_BOARD_TORQUE_LIMIT;
    }
    if (b->force_limit < 0.0f ||
        (b->force_limit > 0.0f) != ((b->capabilities & SC_CAPABILITY_ADVANCE_MOTOR) != 0)) {
        return FW_BOARD_FORCE_LIMIT;
    }
    int problem = motion_problem(b);
    problem = problem != FW_BOARD_POSSIBLE ? problem : power_problem(b);
    return problem != FW_BOARD_POSSIBLE ? problem : home_problem(b);
}

int fw_board_problem(const fw_board *board, const char **sentence)
{
    const int problem = problem_of(board);
    if (sentence != 0) {
        *sentence = SENTENCES[problem];
    }
    return problem;
}
