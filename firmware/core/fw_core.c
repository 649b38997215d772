/* Messages from the host, phases, and what the motors do. */
#include "fw_parts.h"

#include <string.h>

#define UNHEARD_US 5000000u /* without a valid frame the stream and homing end */
#define DEFAULT_BRAKE_AFTER_MS 10.0f

static void handle(fw_core *core, const uint8_t *payload, size_t size);
static void change_phase(fw_core *core, const fw_inputs *inputs);
static void drive(fw_core *core, const fw_inputs *inputs, fw_outputs *outputs);
static void send_state(fw_core *core, const fw_inputs *inputs, const fw_outputs *outputs);

int fw_init(fw_core *core, const fw_board *board)
{
    memset(core, 0, sizeof *core);
    core->board = *board;
    core->problem = (uint8_t)fw_board_problem(board, 0);
    core->tick_s = 1e-6f * (float)board->tick_us;
    core->brake_after_ms = DEFAULT_BRAKE_AFTER_MS;
    core->homed = !fw_has(core, SC_CAPABILITY_HOMES);
    core->phase = core->homed ? FW_READY : FW_UNHOMED;
    sc_decoder_init(&core->decoder);
    return core->problem == FW_BOARD_POSSIBLE;
}

void fw_let_render(fw_core *core, fw_render *render, float *memory, uint32_t capacity)
{
    fw_render_init(render, memory, capacity);
    core->render = render;
    core->board.capabilities |= SC_CAPABILITY_RENDERS;
}

void fw_receive(fw_core *core, const uint8_t *data, size_t size)
{
    size_t taken = 0;
    int got = 0;
    while (core->problem == FW_BOARD_POSSIBLE &&
           (got = sc_decoder_feed(&core->decoder, data, size, &taken)) > 0) {
        core->unheard_ticks = 0;
        handle(core, core->decoder.buffer, (size_t)got);
    }
}

void fw_tick(fw_core *core, const fw_inputs *inputs, fw_outputs *outputs)
{
    outputs->torque = outputs->force = 0.0f;
    outputs->drive = FW_RELEASE;
    if (core->problem != FW_BOARD_POSSIBLE) {
        return;
    }
    core->sequence++;
    fw_measure(core, inputs);
    change_phase(core, inputs);
    drive(core, inputs, outputs);
    if (core->streaming) {
        send_state(core, inputs, outputs);
    }
}

int fw_phase(const fw_core *core)
{
    return core->phase;
}

int fw_cause(const fw_core *core)
{
    return core->cause;
}

int fw_home_result(const fw_core *core)
{
    return core->home_result;
}

uint32_t fw_extend_us(uint32_t last, uint32_t reading, unsigned bits)
{
    const uint32_t mask = bits < 32u ? (UINT32_C(1) << bits) - 1u : UINT32_MAX;
    return last + ((reading - last) & mask);
}

static int enable_asked(const fw_core *core)
{
    return (core->command.flags & SC_COMMAND_ENABLE) != 0;
}

static void obey(fw_core *core, const sc_command *command)
{
    if (!fw_finite(command->torque) || !fw_finite(command->force)) {
        return;
    }
    core->command = *command;
    core->command_ticks = 0;
    core->lost = 0;
    if ((command->flags & SC_COMMAND_CLEAR_FAULT) != 0) {
        core->clear_asked = 1;
    }
}

static void introduce(fw_core *core, uint32_t nonce)
{
    const fw_board *board = &core->board;
    uint8_t payload[SC_SIZE_IDENTITY];
    sc_identity identity;
    memset(&identity, 0, sizeof identity);
    identity.protocol_version = SC_PROTOCOL_VERSION;
    identity.capabilities = (uint16_t)board->capabilities;
    identity.nonce_echo = nonce;
    identity.schema_hash = sc_schema_hash();
    memcpy(identity.name, board->name, sizeof identity.name);
    memcpy(identity.serial, board->serial, sizeof identity.serial);
    identity.firmware_version = board->firmware_version;
    identity.tick_us = board->tick_us;
    identity.torque_limit = board->torque_limit;
    identity.force_limit = board->force_limit;
    identity.opening_min = board->opening_min;
    identity.opening_max = board->opening_max;
    identity.advance_min = board->advance_min;
    identity.advance_max = board->advance_max;
    identity.opening_resolution = board->opening_resolution;
    identity.advance_resolution = board->advance_resolution;
    identity.handle_radius = board->handle_radius;
    fw_put_reply(&core->outbox, payload, sc_pack_identity(&identity, payload));
}

/* HOME: refused while the motors follow commands or a fault stands. */
static int set_home(fw_core *core, float value)
{
    if (value == 0.0f) {
        core->home_asked = 0;
        if (core->phase == FW_HOMING) {
            fw_home_end(core, FW_HOME_STOPPED);
        }
        return 1;
    }
    if (value != 1.0f || core->phase == FW_FAULT || enable_asked(core)) {
        return 0;
    }
    core->home_asked = core->phase != FW_HOMING;
    return 1;
}

static void configure(fw_core *core, const sc_config *config)
{
    uint8_t payload[SC_SIZE_CONFIG_ECHO];
    sc_config_echo echo = {SC_CONFIG_UNKNOWN_KEY, config->key, config->nonce, 0.0f};
    const float value = config->value;
    int fits = 1;
    if (config->key == SC_KEY_STREAM) {
        fits = value == 0.0f || value == 1.0f;
        core->streaming = fits ? value == 1.0f : core->streaming;
        echo.value = (float)core->streaming;
    } else if (config->key == SC_KEY_BRAKE_AFTER_MS) {
        fits = value >= 1.0f && value <= 1000.0f;
        core->brake_after_ms = fits ? value : core->brake_after_ms;
        echo.value = core->brake_after_ms;
    } else if (config->key == SC_KEY_HOME && fw_has(core, SC_CAPABILITY_HOMES)) {
        fits = set_home(core, value);
        echo.value = core->home_asked || core->phase == FW_HOMING ? 1.0f : 0.0f;
    } else if (config->key == SC_KEY_RENDER && core->render != NULL) {
        fits = (value != 1.0f || core->phase != FW_FAULT) &&
               fw_render_set(core->render, value) == SC_CONFIG_OK;
        echo.value = (float)core->render->on;
    } else {
        fits = -1;
    }
    if (fits >= 0) {
        echo.status = fits ? SC_CONFIG_OK : SC_CONFIG_VALUE_REFUSED;
    }
    fw_put_reply(&core->outbox, payload, sc_pack_config_echo(&echo, payload));
}

static void end_rendering(fw_core *core)
{
    if (core->render != NULL) {
        fw_render_set(core->render, 0.0f);
    }
}

static void load(fw_core *core, const uint8_t *payload, size_t size)
{
    uint8_t reply[SC_SIZE_LOAD_ECHO];
    sc_load_echo echo;
    const int is_busy = core->phase == FW_ENABLED || enable_asked(core);
    if (core->render == NULL ? fw_refuse_load(payload, size, &echo)
                             : fw_render_load(core->render, payload, size, is_busy, &echo)) {
        fw_put_reply(&core->outbox, reply, sc_pack_load_echo(&echo, reply));
    }
}

static void handle(fw_core *core, const uint8_t *payload, size_t size)
{
    sc_command command;
    sc_hello hello;
    sc_config config;
    if (sc_unpack_command(payload, size, &command)) {
        obey(core, &command);
    } else if (sc_unpack_hello(payload, size, &hello)) {
        introduce(core, hello.nonce);
    } else if (sc_unpack_config(payload, size, &config)) {
        configure(core, &config);
    } else {
        load(core, payload, size);
    }
}

static void latch(fw_core *core, uint8_t cause)
{
    if (core->phase == FW_HOMING) {
        fw_home_end(core, FW_HOME_FAULT);
    }
    core->phase = FW_FAULT;
    core->cause = cause;
    end_rendering(core); /* and with it the longer silence that the host may have */
}

static int is_silent(const fw_core *core, float limit_ms)
{
    return (float)core->command_ticks * (float)core->board.tick_us >= 1e3f * limit_ms;
}

/* Count the silence of the host; what it ends. A device that renders by itself bears more of it. */
static void listen(fw_core *core)
{
    const uint32_t tick_us = core->board.tick_us;
    const int by_itself = core->render != NULL && core->render->on;
    const float limit_ms = by_itself ? (float)FW_RENDER_SILENCE_MS : core->brake_after_ms;
    if (enable_asked(core) && is_silent(core, limit_ms)) {
        core->lost = 1;
    }
    core->command_ticks += core->command_ticks < UINT32_MAX;
    core->unheard_ticks += core->unheard_ticks < UINT32_MAX;
    if (core->unheard_ticks >= (UNHEARD_US + tick_us - 1u) / tick_us) {
        core->streaming = 0;
        core->home_asked = 0;
        end_rendering(core);
        if (core->phase == FW_HOMING) {
            fw_home_end(core, FW_HOME_STOPPED);
        }
    }
}

static void change_phase(fw_core *core, const fw_inputs *inputs)
{
    listen(core);
    const uint8_t cause = fw_present_cause(core, inputs);
    if (core->phase == FW_FAULT) {
        if (core->clear_asked && cause == SC_CAUSE_NONE) {
            core->phase = core->homed ? FW_READY : FW_UNHOMED;
            core->cause = SC_CAUSE_NONE;
        }
    } else if (cause != SC_CAUSE_NONE) {
        latch(core, cause);
    } else if (core->home_asked) {
        fw_home_begin(core, inputs);
    }
    core->clear_asked = 0;
    core->home_asked = 0;
    if (core->phase == FW_UNHOMED || core->phase == FW_HOMING) {
        core->command.flags &= (uint16_t)~SC_COMMAND_ENABLE; /* never enables by itself later */
    } else if (core->phase != FW_FAULT) {
        core->phase = enable_asked(core) ? FW_ENABLED : FW_READY;
    }
}

/* The wanted value, or what the slew allows of the way there from the last one; what is not a number
 * counts as 0. */
static float slewed(float last, float wanted, float step)
{
    wanted = fw_finite(wanted) ? wanted : 0.0f;
    if (fw_magnitude(wanted - last) <= step) {
        return wanted;
    }
    return wanted > last ? last + step : last - step;
}

/* No effort that pushes on beyond a stop. */
static float stopped(float effort, float place, float low, float high)
{
    return (place <= low && effort < 0.0f) || (place >= high && effort > 0.0f) ? 0.0f : effort;
}

/* What the loaded package gives in this tick; zero without one. */
static fw_render_tick_outputs render(const fw_core *core, const fw_inputs *inputs, float opening)
{
    fw_render_tick_outputs out = {0.0f, 0.0f, 0};
    if (core->render != NULL) {
        const fw_render_tick_inputs in = {inputs->device_us,
                                          core->board.tick_us,
                                          opening,
                                          fw_has_carriage(core) ? inputs->advance : 0.0f,
                                          inputs->motor_torque,
                                          core->phase == FW_ENABLED};
        fw_render_tick(core->render, &in, &out);
    }
    return out;
}

static void drive(fw_core *core, const fw_inputs *inputs, fw_outputs *outputs)
{
    const fw_board *board = &core->board;
    const float torque_step = board->torque_slew * core->tick_s;
    const uint8_t hold = core->command.hold_ticks;
    const float opening = inputs->opening + core->opening_zero;
    const fw_render_tick_outputs rendered = render(core, inputs, opening);
    const int is_stale = rendered.rendering && is_silent(core, core->brake_after_ms);
    core->saturated = 0;
    core->rendering = (uint8_t)rendered.rendering;
    if (core->phase == FW_ENABLED) {
        const int holds = (hold == 0 || core->command_ticks <= hold) && !is_stale;
        const float torque = rendered.torque + (holds ? core->command.torque : 0.0f);
        const float force = rendered.force + (holds ? core->command.force : 0.0f);
        core->saturated = fw_magnitude(torque) > board->torque_limit;
        outputs->drive = FW_DRIVE;
        outputs->torque = stopped(
            slewed(core->torque, fw_clip(torque, board->torque_limit), torque_step),
            opening, board->opening_min, board->opening_max);
        if (fw_has(core, SC_CAPABILITY_ADVANCE_MOTOR)) {
            outputs->force = stopped(slewed(core->force, fw_clip(force, board->force_limit),
                                            board->force_slew * core->tick_s),
                                     inputs->advance, board->advance_min, board->advance_max);
        }
    } else if (core->phase == FW_HOMING) {
        const float torque = fw_home_tick(core, inputs);
        if (core->phase == FW_HOMING) {
            outputs->drive = FW_DRIVE;
            outputs->torque = slewed(core->torque, torque, torque_step);
        }
    } else if (core->phase == FW_FAULT) {
        outputs->drive = FW_BRAKE;
    }
    core->torque = outputs->torque;
    core->force = outputs->force;
}

static uint16_t state_flags(const fw_core *core, const fw_inputs *inputs, float opening)
{
    const fw_board *board = &core->board;
    unsigned flags = core->phase == FW_ENABLED ? SC_STATE_MOTOR_ENABLED : 0u;
    flags |= core->phase == FW_FAULT ? SC_STATE_FAULT_LATCHED : 0u;
    flags |= core->lost ? SC_STATE_COMMANDS_LOST : 0u;
    flags |= core->saturated ? SC_STATE_TORQUE_SATURATED : 0u;
    flags |= core->encoder_doubt > 0 ? SC_STATE_ENCODER_FAULT : 0u;
    flags |= core->homed ? 0u : SC_STATE_NOT_HOMED;
    flags |= core->phase == FW_HOMING ? SC_STATE_HOMING : 0u;
    flags |= core->rendering ? SC_STATE_RENDERING : 0u;
    flags |= (inputs->flags & FW_IN_FORCE_SATURATED) != 0 ? SC_STATE_HANDLE_FORCE_SATURATED : 0u;
    if (core->homed && (opening < board->opening_min + board->opening_resolution ||
                        opening > board->opening_max - board->opening_resolution)) {
        flags |= SC_STATE_OPENING_AT_STOP;
    }
    return (uint16_t)flags;
}

static void send_state(fw_core *core, const fw_inputs *inputs, const fw_outputs *outputs)
{
    sc_state state;
    state.opening = inputs->opening + core->opening_zero;
    state.cause = core->cause;
    if (core->phase == FW_UNHOMED && core->home_result > FW_HOME_FOUND) {
        state.cause = (uint8_t)(FW_CAUSE_HOME + core->home_result);
    }
    state.flags = state_flags(core, inputs, state.opening);
    state.sequence = core->sequence;
    state.device_us = inputs->device_us;
    state.advance = fw_has_carriage(core) ? inputs->advance : 0.0f;
    state.motor_torque =
        fw_has(core, SC_CAPABILITY_TORQUE_MEASURED) ? inputs->motor_torque : outputs->torque;
    state.handle_force =
        fw_has(core, SC_CAPABILITY_HANDLE_FORCE_SENSOR) ? inputs->handle_force : 0.0f;
    fw_put_state(&core->outbox, &state);
}
