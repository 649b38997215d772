#include "sc_passivity.h"

#include <math.h>

static const float MEMORY_S = 0.5f; /* of the observer: some periods of the slowest oscillation */
static const float LEAST_SQUARE = 1e-6f; /* (rad/s)^2, keeps the division finite */

static int is_level(float value)
{
    return isfinite(value) && value >= 0.0f;
}

int sc_passivity_is_sound(const sc_passivity_config *config)
{
    return is_level(config->rig_damping) && is_level(config->rig_coulomb) &&
           is_level(config->margin_J) && is_level(config->most_damping) &&
           is_level(config->handle_radius) && is_level(config->friction_width);
}

double sc_port_delivered(const sc_passivity_config *config, sc_port *port, double turned,
                         double moved, float sent_torque, float sent_force, float measured)
{
    const uint32_t now = config->is_measured && isfinite(measured) ? 1u : 0u;
    double torque = (double)sent_torque;
    if (now && port->was_measured) {
        torque = 0.5 * ((double)port->measured + (double)measured);
    }
    port->was_measured = now;
    port->measured = measured;
    return torque * turned + (double)sent_force * moved;
}

double sc_port_hand(const sc_passivity_config *config, sc_port *port, double turned, float force)
{
    const uint32_t now = config->handle_radius > 0.0f && isfinite(force) ? 1u : 0u;
    double work = 0.0;
    if (now && port->had_hand) {
        const double mean = 0.5 * ((double)port->hand_force + (double)force);
        work = -(double)config->handle_radius * mean * turned;
    }
    port->had_hand = now;
    port->hand_force = force;
    return work;
}

static float within(float value, float limit)
{
    return fminf(fmaxf(value, -limit), limit);
}

static double mean_work(float before, float now, double way)
{
    return 0.5 * ((double)before + (double)now) * way;
}

/* The model's energies over a tick, with the ramp's share. */
static void book_model(sc_port *port, sc_ledger *ledger, const sc_port_tick *tick,
                       const sc_step_output *step)
{
    const double share = 0.5 * ((double)port->share + (double)tick->share);
    const double level = 0.5 * ((double)port->model_J + (double)step->stored_J);
    ledger->stored_J = (double)tick->share * (double)step->stored_J;
    ledger->engaged_J += level * ((double)tick->share - (double)port->share);
    ledger->fracture_J += share * (double)step->fracture_J;
    ledger->arrest_J += share * (double)step->arrest_J;
    ledger->friction_J -=
        mean_work(port->friction, tick->share * step->friction_torque, tick->turned);
}

/* How much energy the loop made that the rig's own friction does not take. */
static void observe(const sc_passivity_config *config, sc_port *port, const sc_port_tick *tick,
                    double late)
{
    const double rate = tick->dt > 0.0f ? tick->turned / (double)tick->dt : 0.0;
    const double taken = (double)config->rig_coulomb * fabs(tick->turned) +
                         (double)config->rig_damping * rate * tick->turned;
    const double kept = tick->dt < MEMORY_S ? 1.0 - (double)(tick->dt / MEMORY_S) : 0.0;
    const double observed = kept * port->observed_J + late - taken;
    port->observed_J = observed > 0.0 ? observed : 0.0;
}

static float injected(const sc_passivity_config *config, const sc_port *port,
                      const sc_port_tick *tick)
{
    const float excess = (float)port->observed_J - config->margin_J;
    if (!(excess > 0.0f) || !(tick->dt > 0.0f)) {
        return 0.0f;
    }
    const float square = fmaxf(tick->rate * tick->rate, LEAST_SQUARE);
    return -fminf(config->most_damping, excess / (tick->dt * square)) * tick->rate;
}

float sc_port_render(const sc_passivity_config *config, sc_port *port, sc_ledger *ledger,
                     const sc_port_tick *tick, const sc_step_output *step)
{
    if (!port->started) { /* nothing was rendered over the way to here: no motion paid for it */
        port->share = tick->share;
        port->model_J = step->stored_J;
        ledger->engaged_J += (double)tick->share * ((double)step->stored_J +
                                                    (double)step->fracture_J +
                                                    (double)step->arrest_J);
        port->given_torque = port->given_force = port->friction = 0.0f;
        port->limited_torque = port->limited_force = port->injected = 0.0f;
        port->started = 1;
    }
    const float wanted = tick->share * step->torque, push = tick->share * step->force;
    const float torque = within(wanted, tick->torque_limit);
    const float force = within(push, tick->force_limit);
    book_model(port, ledger, tick, step);
    const double commanded = mean_work(port->given_torque, torque, tick->turned) +
                             mean_work(port->given_force, force, tick->moved);
    const double late = tick->delivered - commanded;
    observe(config, port, tick, late);
    const float added = injected(config, port, tick);
    const double damped = mean_work(port->injected, added, tick->turned);
    ledger->injected_J += damped;
    ledger->late_J += late - damped;
    ledger->limited_J += mean_work(port->limited_torque, torque - wanted, tick->turned) +
                         mean_work(port->limited_force, force - push, tick->moved);
    port->share = tick->share;
    port->model_J = step->stored_J;
    port->given_torque = torque;
    port->given_force = force;
    port->friction = tick->share * step->friction_torque;
    port->limited_torque = torque - wanted;
    port->limited_force = force - push;
    port->injected = added;
    return added;
}

void sc_port_rest(sc_port *port, sc_ledger *ledger)
{
    ledger->engaged_J -= ledger->stored_J;
    ledger->stored_J = 0.0;
    port->started = 0;
    port->anchor.is_set = 0;
}
