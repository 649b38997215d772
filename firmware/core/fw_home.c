/* Homing: slowly, with little torque, to the home switch or to the stop; leaves it first where it
 * begins there, so that home is always met from the same side. */
#include "fw_parts.h"

#define STILL_S 0.25f /* without motion under home_torque: a stop, or a jam */
#define LEAVE_RAD 0.05f /* so far from the stop before it is approached */

void fw_home_begin(fw_core *core, const fw_inputs *last)
{
    core->phase = FW_HOMING;
    core->homed = 0;
    core->home_result = FW_HOME_NOT_TRIED;
    core->home_ticks = core->home_still = 0;
    core->home_leaving = (uint8_t)(core->board.home_at_stop || (last->flags & FW_IN_AT_HOME) != 0);
    core->home_moved = 0;
    core->home_from = core->home_start = last->opening;
}

void fw_home_end(fw_core *core, uint8_t result)
{
    core->home_result = result;
    core->homed = result == FW_HOME_FOUND;
    core->phase = core->homed ? FW_READY : FW_UNHOMED;
}

/* Whether the blades stand although they are pushed. */
static int stands(fw_core *core, float opening)
{
    if (fw_magnitude(opening - core->home_from) > 2.0f * core->board.opening_resolution) {
        core->home_from = opening;
        core->home_still = 0;
        core->home_moved = 1;
    }
    return (float)core->home_still++ * core->tick_s >= STILL_S;
}

float fw_home_tick(fw_core *core, const fw_inputs *inputs)
{
    const fw_board *board = &core->board;
    const int standing = stands(core, inputs->opening);
    const int at_switch = !board->home_at_stop && (inputs->flags & FW_IN_AT_HOME) != 0;
    if (core->home_leaving) {
        const float left = fw_magnitude(inputs->opening - core->home_start);
        if (board->home_at_stop ? left > LEAVE_RAD || standing : !at_switch) {
            core->home_leaving = 0;
            core->home_still = 0;
        }
    } else if (board->home_at_stop ? standing && core->home_moved : at_switch) {
        core->opening_zero = board->home_opening - inputs->opening;
        fw_home_end(core, FW_HOME_FOUND);
        return 0.0f;
    }
    if ((float)core->home_ticks++ * core->tick_s >= board->home_timeout) {
        fw_home_end(core, core->home_moved ? FW_HOME_TIMED_OUT : FW_HOME_JAMMED);
        return 0.0f;
    }
    /* Full torque at rest, none at home_speed: a damper, which no tuning can make unstable below
     * home_torque / home_speed = inertia / (4 ticks). */
    const float largest = core->home_leaving ? -board->home_torque : board->home_torque;
    const float towards = largest < 0.0f ? -core->rate : core->rate;
    return fw_clip(largest * (1.0f - towards / board->home_speed), fw_magnitude(largest));
}
