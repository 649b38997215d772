/* What docs/protocol.md asks of a device, and what firmware/README.md states of the core. */
#include "check.h"
#include "rig.h"

#include <stdlib.h>

#define ENABLE SC_COMMAND_ENABLE
#define CLEAR SC_COMMAND_CLEAR_FAULT

static void start_streaming(rig *r, const fw_board *board)
{
    CHECK(start(r, board), "the board is possible");
    set(r, SC_KEY_STREAM, 1.0f);
    tick(r);
}

static void check_identity(void)
{
    rig r;
    const fw_board board = sound_board();
    CHECK(start(&r, &board), "possible");
    hello(&r, 0xDEADBEEFu);
    ticks(&r, 3);
    CHECK(r.identities == 1 && r.states == 0, "answers HELLO, streams nothing by itself");
    CHECK(r.identity.nonce_echo == 0xDEADBEEFu, "nonce");
    CHECK(r.identity.schema_hash == sc_schema_hash(), "schema");
    CHECK(r.identity.protocol_version == SC_PROTOCOL_VERSION, "version");
    CHECK(memcmp(r.identity.name, "test\0", 5) == 0, "name");
    CHECK(r.identity.tick_us == 1000 && r.identity.torque_limit == 0.5f, "figures");
    CHECK(r.identity.opening_max == 1.0f && r.identity.handle_radius == 0.06f, "figures");
    CHECK(r.out.outputs.drive == FW_RELEASE && r.out.phase == FW_READY, "released");
}

static void check_settings(void)
{
    static const struct {
        unsigned key;
        float value, in_force;
        int status;
    } CASES[] = {
        {SC_KEY_STREAM, 1.0f, 1.0f, SC_CONFIG_OK},
        {SC_KEY_STREAM, 0.5f, 1.0f, SC_CONFIG_VALUE_REFUSED},
        {SC_KEY_BRAKE_AFTER_MS, 0.5f, 10.0f, SC_CONFIG_VALUE_REFUSED},
        {SC_KEY_BRAKE_AFTER_MS, NAN, 10.0f, SC_CONFIG_VALUE_REFUSED},
        {SC_KEY_BRAKE_AFTER_MS, 2.5f, 2.5f, SC_CONFIG_OK},
        {SC_KEY_HOME, 1.0f, 0.0f, SC_CONFIG_UNKNOWN_KEY},
        {SC_KEY_MATERIAL, 1.0f, 0.0f, SC_CONFIG_UNKNOWN_KEY},
        {999, 1.0f, 0.0f, SC_CONFIG_UNKNOWN_KEY},
    };
    rig r;
    const fw_board board = sound_board();
    CHECK(start(&r, &board), "possible");
    for (size_t i = 0; i < sizeof CASES / sizeof *CASES; i++) {
        set(&r, CASES[i].key, CASES[i].value);
        tick(&r);
        CHECK(r.echoes == (int)i + 1 && r.echo.nonce == 5, "echo");
        CHECK(r.echo.status == CASES[i].status && r.echo.key == CASES[i].key, "status");
        CHECK(r.echo.value == CASES[i].in_force, "value in force");
    }
    CHECK(r.states == 8, "a STATE each tick from STREAM = 1 on");
    CHECK(r.state.sequence == 8 && r.state.device_us == 8000, "sequence and clock");
}

static void check_commands(void)
{
    rig r;
    const fw_board board = sound_board();
    start_streaming(&r, &board);
    command(&r, 0, 0.2f);
    tick(&r);
    CHECK(r.out.outputs.drive == FW_RELEASE && r.out.outputs.torque == 0.0f, "without ENABLE");
    command_for(&r, ENABLE, 0.2f, 5.0f, 0);
    tick(&r);
    CHECK(r.out.outputs.drive == FW_DRIVE && r.out.outputs.torque == 0.2f, "drives");
    CHECK(r.out.outputs.force == 5.0f, "drives");
    CHECK(has(&r, SC_STATE_MOTOR_ENABLED) && !has(&r, SC_STATE_TORQUE_SATURATED), "flags");
    command(&r, ENABLE, NAN);
    tick(&r);
    CHECK(r.out.outputs.torque == 0.2f, "a COMMAND that is not finite is ignored");
    command(&r, ENABLE, 0.1f);
    command(&r, ENABLE, 0.3f);
    tick(&r);
    CHECK(r.out.outputs.torque == 0.3f, "the later of two COMMANDs holds");
    command_for(&r, ENABLE, -0.51f, 21.0f, 0);
    tick(&r);
    CHECK(r.out.outputs.torque == -0.5f && r.out.outputs.force == 20.0f, "clipped");
    CHECK(has(&r, SC_STATE_TORQUE_SATURATED), "flagged");
    command_for(&r, ENABLE, 0.2f, 0.0f, 2);
    ticks(&r, 2);
    CHECK(r.out.outputs.torque == 0.2f, "holds two ticks");
    tick(&r);
    CHECK(r.out.outputs.torque == 0.0f && r.out.outputs.drive == FW_DRIVE, "then exerts nothing");
    command(&r, 0, 0.2f);
    tick(&r);
    CHECK(r.out.outputs.drive == FW_RELEASE, "released");
}

static void check_slew_and_stops(void)
{
    rig r;
    fw_board board = sound_board();
    board.torque_slew = 10.0f;
    start_streaming(&r, &board);
    command(&r, ENABLE, 0.4f);
    tick(&r);
    NEAR(r.out.outputs.torque, 0.01, 1e-6, "torque", "slew");
    commanded_ticks(&r, 60, ENABLE, 0.4f);
    CHECK(r.out.outputs.torque == 0.4f, "reached exactly");
    r.in.inputs.opening = 0.95f;
    fw_init(&r.core, &r.board);
    board.torque_slew = 1000.0f;
    start_streaming(&r, &board);
    r.in.inputs.opening = 1.0f;
    r.core.measured = 0;
    commanded_ticks(&r, 3, ENABLE, 0.2f);
    CHECK(r.out.outputs.torque == 0.0f && r.out.outputs.drive == FW_DRIVE, "pushes on: nothing");
    CHECK(has(&r, SC_STATE_OPENING_AT_STOP), "flagged");
    commanded_ticks(&r, 3, ENABLE, -0.2f);
    CHECK(r.out.outputs.torque == -0.2f, "away from the stop");
    r.in.inputs.opening = -0.01f;
    r.core.measured = 0;
    r.in.inputs.advance = 0.2f;
    command_for(&r, ENABLE, -0.2f, 3.0f, 0);
    tick(&r);
    CHECK(r.out.outputs.torque == 0.0f && r.out.outputs.force == 0.0f, "beyond both stops");
}

static void check_watchdog(void)
{
    rig r;
    const fw_board board = sound_board();
    start_streaming(&r, &board);
    ticks(&r, 100);
    CHECK(!has(&r, SC_STATE_COMMANDS_LOST), "no fault without ENABLE");
    command(&r, ENABLE, 0.1f);
    ticks(&r, 10);
    CHECK(r.out.outputs.drive == FW_DRIVE, "9 ms of silence");
    tick(&r);
    CHECK(r.out.outputs.drive == FW_BRAKE && r.out.outputs.torque == 0.0f, "10 ms of silence");
    CHECK(has(&r, SC_STATE_COMMANDS_LOST) && has(&r, SC_STATE_FAULT_LATCHED), "flags");
    CHECK(!has(&r, SC_STATE_MOTOR_ENABLED) && r.state.cause == SC_CAUSE_WATCHDOG, "cause");
    command(&r, ENABLE, 0.1f);
    tick(&r);
    CHECK(!has(&r, SC_STATE_COMMANDS_LOST) && has(&r, SC_STATE_FAULT_LATCHED), "stays latched");
    CHECK(r.out.outputs.drive == FW_BRAKE && r.state.cause == SC_CAUSE_WATCHDOG, "brakes");
    command(&r, ENABLE | CLEAR, 0.1f);
    tick(&r);
    CHECK(r.out.outputs.drive == FW_DRIVE && r.state.cause == SC_CAUSE_NONE, "cleared");
    set(&r, SC_KEY_STREAM, 0.0f);
    tick(&r);
    CHECK(r.out.outputs.drive == FW_DRIVE, "STREAM = 0 ends the stream alone");
    ticks(&r, 10);
    CHECK(r.out.outputs.drive == FW_BRAKE, "until the watchdog");
}

static void check_silence(void)
{
    rig r;
    const fw_board board = sound_board();
    start_streaming(&r, &board);
    ticks(&r, 4998);
    CHECK(r.states == 4999, "streams for 5 s");
    ticks(&r, 10);
    CHECK(r.states == 4999, "then no more");
    hello(&r, 1);
    tick(&r);
    CHECK(r.identities == 1, "still answers");
}

/* Each fault by name: how it is provoked, and the clearing that it allows. */
static void provoke(fw_inputs *inputs, int cause)
{
    switch (cause) {
    case SC_CAUSE_ENCODER: inputs->flags = FW_IN_ENCODER_BAD; break;
    case SC_CAUSE_STOP_BUTTON: inputs->flags = FW_IN_STOP_BUTTON; break;
    case SC_CAUSE_CURRENT: inputs->current = 8.5f; break;
    case SC_CAUSE_HEAT: inputs->temperature = 81.0f; break;
    case SC_CAUSE_SUPPLY: inputs->supply = 10.0f; break;
    case SC_CAUSE_DRIVER: inputs->flags = FW_IN_DRIVER_FAULT; break;
    default: break;
    }
}

static void check_causes(void)
{
    static const int CAUSES[] = {SC_CAUSE_ENCODER, SC_CAUSE_STOP_BUTTON, SC_CAUSE_CURRENT,
                                 SC_CAUSE_HEAT,    SC_CAUSE_SUPPLY,      SC_CAUSE_DRIVER};
    for (size_t i = 0; i < sizeof CAUSES / sizeof *CAUSES; i++) {
        rig r;
        const fw_board board = sound_board();
        const int cause = CAUSES[i];
        start_streaming(&r, &board);
        commanded_ticks(&r, 5, ENABLE, 0.1f);
        const fw_inputs sound = r.in.inputs;
        provoke(&r.in.inputs, cause);
        commanded_ticks(&r, 1, ENABLE, 0.1f);
        CHECK(r.out.outputs.drive == FW_BRAKE, "brakes in the same tick");
        CHECK(r.state.cause == cause && has(&r, SC_STATE_FAULT_LATCHED), "named");
        CHECK(has(&r, SC_STATE_ENCODER_FAULT) == (cause == SC_CAUSE_ENCODER), "flag of encoders");
        commanded_ticks(&r, 100, ENABLE | CLEAR, 0.1f);
        CHECK(r.state.cause == cause && r.out.outputs.drive == FW_BRAKE, "not cleared: it lasts");
        const uint32_t clock = r.in.inputs.device_us;
        r.in.inputs = sound;
        r.in.inputs.device_us = clock;
        commanded_ticks(&r, 20, ENABLE, 0.1f);
        CHECK(r.state.cause == cause && r.out.outputs.drive == FW_BRAKE, "latched when it is over");
        r.in.inputs.flags = FW_IN_STOP_BUTTON;
        commanded_ticks(&r, 1, ENABLE, 0.1f);
        CHECK(r.state.cause == cause, "the first cause stays");
        r.in.inputs.flags = 0;
        commanded_ticks(&r, 1, ENABLE | CLEAR, 0.1f);
        CHECK(r.state.cause == SC_CAUSE_NONE && r.out.outputs.drive == FW_DRIVE, "cleared");
        CHECK(r.garbled == 0, "every frame decodes");
    }
}

static void check_numbers_that_are_none(void)
{
    for (int which = 0; which < 5; which++) {
        static const int CAUSES[] = {SC_CAUSE_ENCODER, SC_CAUSE_ENCODER, SC_CAUSE_CURRENT,
                                     SC_CAUSE_SUPPLY, SC_CAUSE_HEAT};
        rig r;
        const fw_board board = sound_board();
        start_streaming(&r, &board);
        float *const inputs[] = {&r.in.inputs.opening, &r.in.inputs.advance, &r.in.inputs.current,
                                 &r.in.inputs.supply, &r.in.inputs.temperature};
        *inputs[which] = which % 2 ? INFINITY : NAN;
        commanded_ticks(&r, 1, ENABLE, 0.1f);
        CHECK(r.state.cause == CAUSES[which] && r.out.outputs.drive == FW_BRAKE, "no number");
    }
}

static void check_speed_and_leap(void)
{
    rig r;
    const fw_board board = sound_board();
    start_streaming(&r, &board);
    for (int i = 0; i < 10; i++) {
        r.in.inputs.opening += 0.03f;
        commanded_ticks(&r, 1, 0, 0.0f);
    }
    CHECK(r.state.cause == SC_CAUSE_NONE, "a hand may be fast while the motors are off");
    commanded_ticks(&r, 20, ENABLE, 0.0f);
    for (int i = 0; i < 12; i++) {
        r.in.inputs.opening -= 0.03f;
        commanded_ticks(&r, 1, ENABLE, 0.0f);
    }
    CHECK(r.state.cause == SC_CAUSE_SPEED, "30 rad/s while driven");
    commanded_ticks(&r, 40, ENABLE | CLEAR, 0.0f);
    CHECK(r.state.cause == SC_CAUSE_NONE, "cleared at rest");
    r.in.inputs.opening += 0.11f;
    commanded_ticks(&r, 1, ENABLE, 0.0f);
    CHECK(r.state.cause == SC_CAUSE_ENCODER && has(&r, SC_STATE_ENCODER_FAULT), "leap");
    commanded_ticks(&r, 15, ENABLE | CLEAR, 0.0f);
    CHECK(r.state.cause == SC_CAUSE_ENCODER, "16 plausible readings first");
    commanded_ticks(&r, 2, ENABLE | CLEAR, 0.0f);
    CHECK(r.state.cause == SC_CAUSE_NONE, "cleared");
}

/* One tick at this clock and place. */
static void measured_at(rig *r, uint32_t us, float opening)
{
    r->in.inputs.device_us = us - r->board.tick_us; /* tick adds it again */
    r->in.inputs.opening = opening;
    commanded_ticks(r, 1, ENABLE, 0.0f);
}

/* A computer that is disturbed measures late, and then several times in a row; across the clock's end. */
static void check_bursts(void)
{
    rig r;
    const fw_board board = sound_board();
    start_streaming(&r, &board);
    const float rate = 8.0f; /* rad/s, of 25 */
    uint32_t us = 0xFFFF0000u, passed = 0;
    measured_at(&r, us, 0.1f);
    commanded_ticks(&r, 40, ENABLE | CLEAR, 0.0f);
    CHECK(r.state.cause == SC_CAUSE_NONE, "at rest");
    us = r.in.inputs.device_us;
    for (int i = 0; i < 60; i++) {
        const uint32_t step = i % 12 == 0 ? 15000u : 20u; /* 15 ms late, then 11 measurements at once */
        passed += step;
        measured_at(&r, us + passed, 0.1f + rate * 1e-6f * (float)passed);
        CHECK(r.state.cause == SC_CAUSE_NONE && has(&r, SC_STATE_MOTOR_ENABLED), "8 rad/s in bursts");
    }
    NEAR(r.core.rate, 8.0, 0.3, "rate", "by the clock");
    const float last = r.in.inputs.opening;
    measured_at(&r, us + passed + 20u, last + 0.11f);
    CHECK(r.state.cause == SC_CAUSE_ENCODER, "a leap is one in a short tick, too");

    start_streaming(&r, &board); /* a clock that stands: the table's tick */
    us = r.in.inputs.device_us;
    for (int i = 0; i < 12; i++) {
        measured_at(&r, us, 0.5f - 0.03f * (float)i);
    }
    CHECK(r.state.cause == SC_CAUSE_SPEED, "30 rad/s by the tick");

    start_streaming(&r, &board); /* too fast in bursts, too */
    us = r.in.inputs.device_us;
    passed = 0;
    for (int i = 0; i < 72; i++) {
        passed += i % 12 == 0 ? 2000u : 20u;
        measured_at(&r, us + passed, 0.5f - 30e-6f * (float)passed);
    }
    CHECK(r.state.cause == SC_CAUSE_SPEED, "30 rad/s by the clock");
}

static void check_heat(void)
{
    rig r;
    const fw_board board = sound_board();
    start_streaming(&r, &board);
    commanded_ticks(&r, 3000, ENABLE, 0.0f); /* a motor at rest gets no colder than it is */
    r.in.inputs.current = 4.0f; /* 16 - 4 = 12 A^2: 10 A^2 s last 833 ms */
    commanded_ticks(&r, 820, ENABLE, 0.4f);
    CHECK(r.state.cause == SC_CAUSE_NONE, "not yet");
    commanded_ticks(&r, 30, ENABLE, 0.4f);
    CHECK(r.state.cause == SC_CAUSE_CURRENT, "current squared over time");
    r.in.inputs.current = 0.0f;
    commanded_ticks(&r, 200, ENABLE | CLEAR, 0.0f);
    CHECK(r.state.cause == SC_CAUSE_NONE, "cool again");
    fw_board blind = board;
    blind.capabilities &= ~(uint32_t)SC_CAPABILITY_TORQUE_MEASURED;
    start_streaming(&r, &blind);
    r.in.inputs.current = 99.0f;
    commanded_ticks(&r, 860, ENABLE, 0.4f);
    CHECK(r.state.cause == SC_CAUSE_CURRENT, "from the torque, where no current is measured");
    CHECK(r.state.motor_torque == 0.0f, "a blind device sends what it gives: 0 while it brakes");
}

/* Blades with inertia and dry friction, a stop at 0 and at 1 rad; the encoder has its own zero. */
typedef struct {
    float opening, rate, zero, friction;
} blades;

static void move(blades *b, rig *r)
{
    float effort = r->out.outputs.torque;
    const float dry = b->rate > 0.0f ? b->friction : -b->friction;
    if (b->rate == 0.0f) {
        effort = fabsf(effort) <= b->friction ? 0.0f
                                              : effort - (effort > 0.0f ? b->friction : -b->friction);
        b->rate = effort / 1e-3f * 1e-3f;
    } else {
        const float before = b->rate;
        b->rate += (effort - dry) / 1e-3f * 1e-3f;
        b->rate = before * b->rate < 0.0f ? 0.0f : b->rate;
    }
    b->opening += b->rate * 1e-3f;
    if (b->opening < 0.0f || b->opening > 1.0f) {
        b->opening = b->opening < 0.0f ? 0.0f : 1.0f;
        b->rate = 0.0f;
    }
    r->in.inputs.opening = 1e-4f * floorf((b->opening - b->zero) / 1e-4f);
    r->in.inputs.flags = b->opening > 0.9f ? FW_IN_AT_HOME : 0;
}

static void home(rig *r, blades *b, const fw_board *board, float most_torque)
{
    start_streaming(r, board);
    r->in.inputs.opening = 1e-4f * floorf((b->opening - b->zero) / 1e-4f);
    r->in.inputs.flags = b->opening > 0.9f ? FW_IN_AT_HOME : 0;
    r->core.measured = 0;
    commanded_ticks(r, 50, ENABLE, 0.1f);
    CHECK(has(r, SC_STATE_NOT_HOMED) && r->out.outputs.drive == FW_RELEASE, "never by itself");
    set(r, SC_KEY_HOME, 1.0f);
    tick(r);
    CHECK(r->echo.status == SC_CONFIG_OK, "begins");
    for (int i = 0; i < 20000 && r->out.phase == FW_HOMING; i++) {
        CHECK(fabsf(r->out.outputs.torque) <= most_torque, "little torque");
        CHECK(fabsf(b->rate) <= 2.0f * board->home_speed, "slow");
        CHECK(has(r, SC_STATE_HOMING) && !has(r, SC_STATE_MOTOR_ENABLED), "flags");
        if (i % 500 == 0) {
            command(r, ENABLE, 0.3f); /* has no effect, then or later */
        }
        move(b, r);
        tick(r);
    }
}

static void check_homing(void)
{
    fw_board board = homing_board();
    for (int from = 0; from < 2; from++) { /* from afar, and from the switch */
        rig r;
        blades b = {from ? 0.97f : 0.3f, 0.0f, 3.0f, 0.01f};
        home(&r, &b, &board, 0.05f);
        CHECK(r.out.home_result == FW_HOME_FOUND && r.out.phase == FW_READY, "found");
        ticks(&r, 30);
        CHECK(r.out.outputs.drive == FW_RELEASE && !has(&r, SC_STATE_NOT_HOMED), "released");
        NEAR(r.state.opening, 0.9, 2e-3, "opening", "switch");
        commanded_ticks(&r, 3, ENABLE, 0.1f);
        CHECK(has(&r, SC_STATE_MOTOR_ENABLED), "enables");
        set(&r, SC_KEY_HOME, 1.0f);
        tick(&r);
        CHECK(r.echo.status == SC_CONFIG_VALUE_REFUSED, "not while enabled");
        r.in.inputs.opening += 0.2f;
        commanded_ticks(&r, 1, ENABLE, 0.0f);
        CHECK(has(&r, SC_STATE_NOT_HOMED) && r.state.cause == SC_CAUSE_ENCODER, "a leap: no zero");
        commanded_ticks(&r, 20, ENABLE | CLEAR, 0.1f);
        CHECK(r.out.phase == FW_UNHOMED && r.out.outputs.drive == FW_RELEASE, "home again first");
        CHECK(r.state.cause == SC_CAUSE_NONE, "no search failed");
    }
    board.home_at_stop = 1;
    board.home_opening = 1.0f;
    board.home_timeout = 8.0f;
    for (int from = 0; from < 2; from++) { /* from afar, and from the stop */
        rig r;
        blades b = {from ? 1.0f : 0.4f, 0.0f, -2.0f, 0.01f};
        home(&r, &b, &board, 0.05f);
        CHECK(r.out.home_result == FW_HOME_FOUND, "found");
        tick(&r);
        NEAR(r.state.opening, 1.0, 1e-3, "opening", "stop");
    }
}

static void check_homing_that_fails(void)
{
    fw_board board = homing_board();
    rig r;
    blades jammed = {0.3f, 0.0f, 0.0f, 0.06f};
    home(&r, &jammed, &board, 0.05f);
    CHECK(r.out.home_result == FW_HOME_JAMMED && r.out.phase == FW_UNHOMED, "jammed");
    CHECK(r.state.cause == FW_CAUSE_HOME + FW_HOME_JAMMED, "the host reads why");
    CHECK(!has(&r, SC_STATE_FAULT_LATCHED) && has(&r, SC_STATE_NOT_HOMED), "which is no fault");
    board.home_torque = -0.05f;
    blades wrong_way = {0.3f, 0.0f, 0.0f, 0.01f};
    home(&r, &wrong_way, &board, 0.05f);
    CHECK(r.out.home_result == FW_HOME_TIMED_OUT, "no switch that way");
    CHECK(has(&r, SC_STATE_NOT_HOMED) && !has(&r, SC_STATE_HOMING), "flags");
    CHECK(r.state.cause == FW_CAUSE_HOME + FW_HOME_TIMED_OUT, "why");
    set(&r, SC_KEY_HOME, 1.0f);
    ticks(&r, 2);
    r.in.inputs.flags = FW_IN_STOP_BUTTON;
    tick(&r);
    CHECK(r.out.home_result == FW_HOME_FAULT && r.out.outputs.drive == FW_BRAKE, "stop button");
    CHECK(r.state.cause == SC_CAUSE_STOP_BUTTON, "a fault's own cause comes first");
    r.in.inputs.flags = 0;
    command(&r, CLEAR, 0.0f);
    tick(&r);
    CHECK(r.out.phase == FW_UNHOMED, "cleared, still without a zero");
    CHECK(r.state.cause == FW_CAUSE_HOME + FW_HOME_FAULT, "why");
    set(&r, SC_KEY_HOME, 1.0f);
    ticks(&r, 2);
    set(&r, SC_KEY_HOME, 0.0f);
    tick(&r);
    CHECK(r.out.home_result == FW_HOME_STOPPED && r.out.outputs.drive == FW_RELEASE, "stopped");
    board.home_timeout = 60.0f;
    start_streaming(&r, &board);
    set(&r, SC_KEY_HOME, 1.0f);
    ticks(&r, 5001);
    CHECK(r.out.home_result == FW_HOME_STOPPED, "ends with the host");
}

static void check_line(void)
{
    rig r;
    uint8_t data[64];
    const fw_board board = sound_board();
    CHECK(start(&r, &board), "possible");
    set(&r, SC_KEY_STREAM, 1.0f);
    fw_outputs outputs;
    fw_receive(&r.core, r.in.received, r.in.received_size);
    r.in.received_size = 0;
    fw_tick(&r.core, &r.in.inputs, &outputs);
    read_frames(&r, data, fw_take(&r.core, data, sizeof data));
    CHECK(r.echoes == 1 && r.states == 1, "both");
    for (int i = 0; i < 5; i++) {
        fw_tick(&r.core, &r.in.inputs, &outputs);
    }
    read_frames(&r, data, fw_take(&r.core, data, 10)); /* a part */
    fw_tick(&r.core, &r.in.inputs, &outputs);
    hello(&r, 4);
    fw_receive(&r.core, r.in.received, r.in.received_size);
    r.in.received_size = 0;
    for (int i = 0; i < 30; i++) {
        read_frames(&r, data, fw_take(&r.core, data, 7));
    }
    CHECK(r.states == 2 && r.state.sequence == 6, "the newest one that had not begun");
    CHECK(r.identities == 1 && r.garbled == 0, "no frame is torn");
    CHECK(fw_take(&r.core, data, sizeof data) == 0, "nothing queues");
    for (int i = 0; i < 40; i++) {
        hello(&r, 10 + (uint32_t)i);
        fw_receive(&r.core, r.in.received, r.in.received_size);
        r.in.received_size = 0;
    }
    while (1) {
        const size_t size = fw_take(&r.core, data, sizeof data);
        if (size == 0) {
            break;
        }
        read_frames(&r, data, size);
    }
    CHECK(r.identities == 6 && r.garbled == 0, "whole replies as far as there is room");
}

/* A core without memory for an image, as most boards are. */
static void check_no_rendering(void)
{
    rig r;
    uint8_t payload[SC_SIZE_LOAD_CHUNK];
    const fw_board board = sound_board();
    const sc_load_begin begin = {1, 11, 100, 12};
    const sc_load_chunk chunk = {4, 12, 0, {0}};
    const sc_load_commit commit = {13};
    CHECK(start(&r, &board), "possible");
    put(&r, payload, sc_pack_load_begin(&begin, payload));
    tick(&r);
    CHECK(r.load.status == SC_LOAD_OTHER_FORMAT && r.load.nonce == 11, "begin");
    put(&r, payload, sc_pack_load_chunk(&chunk, payload));
    tick(&r);
    CHECK(r.load.status == SC_LOAD_NOT_ANNOUNCED && r.load.nonce == 12, "chunk");
    put(&r, payload, sc_pack_load_commit(&commit, payload));
    tick(&r);
    CHECK(r.load.status == SC_LOAD_NOT_ANNOUNCED && r.load.nonce == 13, "commit");
    CHECK(r.load.capacity == 0 && r.load.received == 0 && r.load.crc32 == 0, "holds nothing");
    set(&r, SC_KEY_RENDER, 1.0f);
    tick(&r);
    CHECK(r.echo.status == SC_CONFIG_UNKNOWN_KEY, "no such key");
}

static void check_timer(void)
{
    CHECK(fw_extend_us(0, 65535, 16) == 65535u, "first");
    CHECK(fw_extend_us(65535, 3, 16) == 65539u, "wraps");
    CHECK(fw_extend_us(0xFFFFFFF0u, 0x0005, 16) == 5u, "both wrap");
    CHECK(fw_extend_us(0xFFFFFFF0u, 7, 32) == 7u, "32 bits");
}

static void check_boards(void)
{
    static const struct {
        size_t offset;
        float value;
        int problem;
    } CASES[] = {
        {offsetof(fw_board, torque_limit), 0.0f, FW_BOARD_TORQUE_LIMIT},
        {offsetof(fw_board, torque_limit), NAN, FW_BOARD_NOT_FINITE},
        {offsetof(fw_board, home_timeout), INFINITY, FW_BOARD_NOT_FINITE},
        {offsetof(fw_board, torque_limit), 1.2f, FW_BOARD_BEYOND_SUPPLY},
        {offsetof(fw_board, torque_limit), 0.9f, FW_BOARD_CURRENT},
        {offsetof(fw_board, force_limit), 0.0f, FW_BOARD_FORCE_LIMIT},
        {offsetof(fw_board, opening_min), 1.0f, FW_BOARD_STOPS},
        {offsetof(fw_board, advance_max), -0.2f, FW_BOARD_STOPS},
        {offsetof(fw_board, opening_resolution), 0.0f, FW_BOARD_RESOLUTION},
        {offsetof(fw_board, advance_resolution), 0.0f, FW_BOARD_RESOLUTION},
        {offsetof(fw_board, handle_radius), 0.0f, FW_BOARD_HANDLE_RADIUS},
        {offsetof(fw_board, torque_slew), 0.0f, FW_BOARD_SLEW},
        {offsetof(fw_board, overspeed), 0.05f, FW_BOARD_OVERSPEED},
        {offsetof(fw_board, opening_leap), 0.02f, FW_BOARD_LEAP},
        {offsetof(fw_board, torque_per_A), 0.0f, FW_BOARD_MOTOR},
        {offsetof(fw_board, resistance), -1.0f, FW_BOARD_MOTOR},
        {offsetof(fw_board, resistance), 3.0f, FW_BOARD_BEYOND_SUPPLY},
        {offsetof(fw_board, current_limit), 1.0f, FW_BOARD_CURRENT},
        {offsetof(fw_board, i2t_limit), 0.0f, FW_BOARD_CURRENT},
        {offsetof(fw_board, supply_max), 5.0f, FW_BOARD_SUPPLY},
        {offsetof(fw_board, temperature_max), -1.0f, FW_BOARD_TEMPERATURE},
        {offsetof(fw_board, home_torque), 0.0f, FW_BOARD_HOME},
        {offsetof(fw_board, home_speed), 0.0f, FW_BOARD_HOME},
        {offsetof(fw_board, home_opening), 2.0f, FW_BOARD_HOME},
    };
    const fw_board sound = homing_board();
    const char *sentence = 0;
    CHECK(fw_board_problem(&sound, &sentence) == FW_BOARD_POSSIBLE, "sound");
    rig r;
    for (size_t i = 0; i < sizeof CASES / sizeof *CASES; i++) {
        fw_board board = sound;
        memcpy((char *)&board + CASES[i].offset, &CASES[i].value, sizeof(float));
        const int problem = fw_board_problem(&board, &sentence);
        CHECK(problem == CASES[i].problem, sentence);
        CHECK(strlen(sentence) > 20 && sentence[strlen(sentence) - 1] == '.', "a sentence");
        CHECK(!start(&r, &board), "refused");
        hello(&r, 1);
        set(&r, SC_KEY_STREAM, 1.0f);
        commanded_ticks(&r, 3, ENABLE, 0.1f);
        CHECK(r.out.outputs.drive == FW_RELEASE && r.out.sent_size == 0, "does nothing");
    }
    static const uint32_t TICKS[] = {0, 249, 10001};
    for (size_t i = 0; i < 3; i++) {
        fw_board board = sound;
        board.tick_us = TICKS[i];
        CHECK(fw_board_problem(&board, 0) == FW_BOARD_TICK, "tick");
    }
}

int main(void)
{
    CHECK(sizeof(fw_record_in) == FW_RECORD_SIZE && sizeof(fw_record_out) == FW_RECORD_SIZE, "size");
    check_identity();
    check_settings();
    check_commands();
    check_slew_and_stops();
    check_watchdog();
    check_silence();
    check_causes();
    check_numbers_that_are_none();
    check_speed_and_leap();
    check_bursts();
    check_heat();
    check_homing();
    check_homing_that_fails();
    check_line();
    check_no_rendering();
    check_timer();
    check_boards();
    return checks_done("core");
}
