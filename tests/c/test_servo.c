#include "check.h"
#include "json.h"
#include "sc_servo.h"

#include <string.h>

enum { MOST = 256 };

typedef struct {
    float opening[MOST], opening_rate[MOST], advance[MOST];
    int32_t stroke[MOST];
} path;

static sc_servo_config load_config(const json *from)
{
    sc_servo_config c;
    memset(&c, 0, sizeof c);
    c.torque_limit = (float)json_number(from, "torque_limit");
    c.torque_slew = (float)json_number(from, "torque_slew");
    c.force_limit = (float)json_number(from, "force_limit");
    c.force_slew = (float)json_number(from, "force_slew");
    c.ramp_s = (float)json_number(from, "ramp_s");
    c.damping_Nm_s_per_rad = (float)json_number(from, "damping_Nm_s_per_rad");
    c.rate_cutoff_Hz = (float)json_number(from, "rate_cutoff_Hz");
    c.opening_kp = (float)json_number(from, "opening_kp");
    c.opening_kd = (float)json_number(from, "opening_kd");
    c.opening_ki = (float)json_number(from, "opening_ki");
    c.advance_kp = (float)json_number(from, "advance_kp");
    c.advance_kd = (float)json_number(from, "advance_kd");
    c.advance_ki = (float)json_number(from, "advance_ki");
    c.opening_error_limit = (float)json_number(from, "opening_error_limit");
    c.advance_error_limit = (float)json_number(from, "advance_error_limit");
    c.opening_low = (float)json_number(from, "opening_low");
    c.opening_high = (float)json_number(from, "opening_high");
    c.opening_rate_limit = (float)json_number(from, "opening_rate_limit");
    c.advance_rate_limit = (float)json_number(from, "advance_rate_limit");
    c.fault_clearings = (uint32_t)json_number(from, "fault_clearings");
    c.tick_us = (uint32_t)json_number(from, "tick_us");
    return c;
}

static double largest(const json *column)
{
    double most = 0.0;
    for (size_t i = 0; i < column->size; i++) {
        most = fmax(most, fabs(column->items[i].number));
    }
    return most;
}

static uint32_t mode_named(const char *name)
{
    if (strcmp(name, "track") == 0) {
        return SC_MODE_TRACK;
    }
    return strcmp(name, "damp") == 0 ? SC_MODE_DAMP : SC_MODE_IDLE;
}

static sc_state state_at(const json *one, size_t i)
{
    sc_state state;
    memset(&state, 0, sizeof state);
    state.flags = SC_STATE_MOTOR_ENABLED;
    state.sequence = (uint32_t)json_get(one, "sequence")->items[i].number;
    state.device_us = (uint32_t)json_get(one, "device_us")->items[i].number;
    state.opening = (float)json_get(one, "opening")->items[i].number;
    state.advance = (float)json_get(one, "advance")->items[i].number;
    return state;
}

static void check_case(const json *one, const sc_reference *reference, double tolerance)
{
    const char *title = json_text(one, "title");
    const sc_servo_config config = load_config(json_get(one, "config"));
    const sc_orders orders = {mode_named(json_text(one, "mode")), 1, 0, 0.0f, 0, 0};
    const json *torque = json_get(one, "torque"), *force = json_get(one, "force");
    const json *rate = json_get(one, "opening_rate"), *speed = json_get(one, "advance_rate");
    sc_servo servo;
    sc_command command;
    memset(&servo, 0, sizeof servo);
    memset(&command, 0, sizeof command);
    CHECK(sc_servo_config_is_sound(&config), title);
    for (size_t i = 0; i < torque->size; i++) {
        const sc_state state = state_at(one, i);
        sc_servo_pass(&config, &orders, &servo, config.tick_us);
        CHECK(sc_servo_step(&config, NULL, reference, &orders, &servo, &state, &command), title);
        sc_servo_sent(&servo);
        CHECK(command.echo_sequence == state.sequence, title);
        NEAR(command.torque, torque->items[i].number, tolerance * largest(torque), "torque", title);
        NEAR(command.force, force->items[i].number, tolerance * largest(force), "force", title);
        NEAR(servo.motion.opening_rate, rate->items[i].number, tolerance * largest(rate), "rate",
             title);
        NEAR(servo.motion.advance_rate, speed->items[i].number, tolerance * largest(speed),
             "advance rate", title);
    }
}

int main(int argc, char **argv)
{
    static path room;
    json vectors = json_load(argc > 1 ? argv[1] : "../golden", "servo.json");
    const json *from = json_get(&vectors, "reference"), *cases = json_get(&vectors, "cases");
    sc_reference reference = {room.opening, room.opening_rate, room.advance, room.stroke, 0, NULL};
    reference.size = (uint32_t)json_floats(json_get(from, "opening"), room.opening, MOST);
    json_floats(json_get(from, "opening_rate"), room.opening_rate, MOST);
    json_floats(json_get(from, "advance"), room.advance, MOST);
    for (size_t i = 0; i < cases->size; i++) {
        check_case(&cases->items[i], &reference, json_number(&vectors, "tolerance"));
    }
    json_free(&vectors);
    return checks_done("servo");
}
