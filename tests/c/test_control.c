/* The mode CONTROL on a plant of its own: a tip on a springy plane or circle, in double precision, its
 * equations written out anew. */
#include "check.h"
#include "controls.h"
#include "sc_control.h"
#include "sc_control_block.h"

#include <stdlib.h>
#include <string.h>

enum { PATH_TICKS = 4000, SUBSTEPS = 20 };

static const double TICK_S = 1e-3, LAG_S = 1e-3, STIFFNESS = 1e4;

/* Truth: two axes with dry friction, one elastic surface; a plane where the radius is 0. */
typedef struct {
    double opening, advance, rate, speed;
    double torque, force; /* of the motors, behind their lag */
    double top_x, top_y;  /* a point of the surface, and its normal's slant */
    double slant, radius;
    double mu, dry_torque, dry_force;
    double damping; /* of the material, [N s/m] */
    double pressed; /* [N] */
    double plate_speed; /* along its normal */
    int removed;
} plant;

static const double STATION = 0.075, OFFSET = -0.0054, INERTIA = 2e-4, MASS = 0.8;

static void tip_of(const plant *p, double *x, double *y)
{
    const double beta = 0.5 * p->opening;
    *x = p->advance + STATION * cos(beta) - OFFSET * sin(beta);
    *y = STATION * sin(beta) + OFFSET * cos(beta);
}

static double gap_of(const plant *p, double *nx, double *ny)
{
    double x, y;
    tip_of(p, &x, &y);
    const double ux = -sin(p->slant), uy = cos(p->slant);
    if (p->radius == 0.0) {
        *nx = ux;
        *ny = uy;
        return ux * (x - p->top_x) + uy * (y - p->top_y);
    }
    const double cx = p->top_x - p->radius * ux, cy = p->top_y - p->radius * uy;
    const double away = hypot(x - cx, y - cy);
    *nx = (x - cx) / away;
    *ny = (y - cy) / away;
    return away - p->radius;
}

/* Rate after a step in which dry friction takes at most what brings the axis to rest. */
static double slowed(double rate, double effort, double mobility, double dry)
{
    const double free_rate = rate + mobility * effort;
    const double taken = mobility * dry;
    return fabs(free_rate) <= taken ? 0.0 : free_rate - copysign(taken, free_rate);
}

static void run_plant(plant *p, const float effort[2])
{
    const double h = TICK_S / SUBSTEPS;
    for (int i = 0; i < SUBSTEPS; i++) {
        double nx, ny;
        p->top_x -= h * p->plate_speed * sin(p->slant);
        p->top_y += h * p->plate_speed * cos(p->slant);
        p->torque += h / LAG_S * (effort[0] - p->torque);
        p->force += h / LAG_S * (effort[1] - p->force);
        p->opening += 0.5 * h * p->rate;
        p->advance += 0.5 * h * p->speed;
        const double gap = gap_of(p, &nx, &ny);
        double x, y;
        tip_of(p, &x, &y);
        const double by_x = -0.5 * y, by_y = 0.5 * (x - p->advance);
        const double slip = ny * (p->rate * by_x + p->speed) - nx * p->rate * by_y;
        const double sinks = p->plate_speed - nx * (p->rate * by_x + p->speed) - ny * p->rate * by_y;
        p->pressed =
            gap < 0.0 && !p->removed ? fmax(-STIFFNESS * gap + p->damping * sinks, 0.0) : 0.0;
        const double drag = -p->mu * p->pressed * tanh(slip / 1e-4);
        const double fx = nx * p->pressed + ny * drag, fy = ny * p->pressed - nx * drag;
        p->rate = slowed(p->rate, p->torque + fx * by_x + fy * by_y, h / INERTIA, p->dry_torque);
        p->speed = slowed(p->speed, p->force + fx, h / MASS, p->dry_force);
        p->opening += 0.5 * h * p->rate;
        p->advance += 0.5 * h * p->speed;
    }
}

static sc_control_config config_of(const plant *p)
{
    sc_control_config c = sound_control();
    c.station = (float)STATION;
    c.edge_offset = (float)OFFSET;
    c.inertia = (float)INERTIA;
    c.mass = (float)MASS;
    flat_friction(&c.opening, (float)p->dry_torque);
    flat_friction(&c.advance, (float)p->dry_force);
    c.surface_friction = (float)p->mu;
    c.stiffness = (float)STIFFNESS;
    return c;
}

/* A run: the servo's rate estimate and the encoder's steps are the test's own. */
typedef struct {
    plant truth;
    sc_control_config config;
    sc_control_task task;
    sc_control control;
    float rate, speed, last_opening, last_advance;
    float effort[2];
    float handle;
    double measured_gain;
    int seen;
} trial;

static float path_place[PATH_TICKS], path_rate[PATH_TICKS], path_force[PATH_TICKS];
static int32_t path_stage[PATH_TICKS];

/* Wait a quarter, then go at `speed` behind a smooth start. */
static void set_path(trial *t, float speed, float force)
{
    float place = 0.0f;
    for (int i = 0; i < PATH_TICKS; i++) {
        const float share = fminf((float)i / 300.0f, 1.0f);
        const float smooth = share * share * (3.0f - 2.0f * share);
        path_rate[i] = speed * smooth;
        path_place[i] = place;
        path_force[i] = force;
        path_stage[i] = i / 1000;
        place += path_rate[i] * (float)TICK_S;
    }
    t->task.path = (sc_path){path_place, path_rate, path_force, path_stage, PATH_TICKS};
}

/* The outer loop: the exact contour at the tip's foot. */
static void look_at(trial *t)
{
    double nx, ny, x, y;
    const plant *p = &t->truth;
    const double gap = gap_of(p, &nx, &ny);
    tip_of(p, &x, &y);
    sc_contour *contour = &t->task.contour;
    contour->point[0] = (float)(x - gap * nx);
    contour->point[1] = (float)(y - gap * ny);
    contour->normal[0] = (float)nx;
    contour->normal[1] = (float)ny;
    contour->velocity[0] = (float)(-p->plate_speed * sin(p->slant));
    contour->velocity[1] = (float)(p->plate_speed * cos(p->slant));
    contour->number++;
    if (p->radius == 0.0) {
        contour->curvature = 0.0f;
        contour->place = (float)((x - p->top_x) * cos(p->slant) + (y - p->top_y) * sin(p->slant));
    } else {
        contour->curvature = (float)(1.0 / p->radius);
        contour->place = (float)(p->radius * (atan2(nx, ny) + p->slant));
    }
}

static void begin(trial *t, double slant, double radius, double dry)
{
    memset(t, 0, sizeof *t);
    plant *p = &t->truth;
    p->opening = 0.5;
    p->advance = -0.02;
    p->slant = slant;
    p->radius = radius;
    p->mu = 0.2;
    p->damping = 10.0;
    p->dry_torque = dry;
    p->dry_force = 50.0 * dry;
    t->measured_gain = 1.0;
    double x, y;
    tip_of(p, &x, &y);
    p->top_x = x;
    p->top_y = y - 2e-3;
    t->config = config_of(p);
    t->task.config = &t->config;
    t->last_opening = (float)p->opening;
    t->last_advance = (float)p->advance;
    set_path(t, 0.01f, 2.0f);
    look_at(t);
}

static float stepped(double value, double step)
{
    return (float)(step * floor(value / step + 0.5));
}

static int tick(trial *t)
{
    const float opening = stepped(t->truth.opening, 4.8e-5);
    const float advance = stepped(t->truth.advance, 1e-6);
    const float weight = 0.715f; /* of 400 Hz at a tick of 1 ms */
    t->rate += weight * ((opening - t->last_opening) * 1e3f - t->rate);
    t->speed += weight * ((advance - t->last_advance) * 1e3f - t->speed);
    t->last_opening = opening;
    t->last_advance = advance;
    const sc_control_tick state = {(float)TICK_S,
                                   opening,
                                   t->rate,
                                   advance,
                                   t->speed,
                                   (float)(t->measured_gain * t->truth.torque),
                                   t->handle};
    const float before[2] = {t->effort[0], t->effort[1]};
    t->seen = sc_control_step(&t->task, &t->control, &state, t->effort);
    CHECK(isfinite(t->effort[0]) && isfinite(t->effort[1]), "efforts are finite");
    run_plant(&t->truth, before); /* a command acts a tick after its state */
    return t->seen;
}

typedef struct {
    double force_rms, path_rms, estimate_rms, peak;
    int lost;
} figures;

/* Run with contours every `every` ticks; figures over the second half. */
static figures run(trial *t, int ticks, int every)
{
    figures f = {0.0, 0.0, 0.0, 0.0, 0};
    int counted = 0;
    for (int i = 0; i < ticks && t->seen == SC_CONTROL_GOES_ON; i++) {
        if (i % every == 0) {
            look_at(t);
        }
        tick(t);
        f.peak = fmax(f.peak, t->truth.pressed);
        f.lost += (t->control.sample.flags & SC_HYBRID_LOST) != 0;
        if (i >= ticks / 2) {
            const sc_control_sample *sample = &t->control.sample;
            f.force_rms += pow(t->truth.pressed - (double)sample->force_wanted, 2.0);
            f.path_rms += pow((double)sample->place - (double)sample->place_wanted, 2.0);
            f.estimate_rms += pow((double)sample->force - t->truth.pressed, 2.0);
            counted++;
        }
    }
    f.force_rms = sqrt(f.force_rms / counted);
    f.path_rms = sqrt(f.path_rms / counted);
    f.estimate_rms = sqrt(f.estimate_rms / counted);
    return f;
}

static void check_run(const char *title, double slant, double radius, double dry, double path)
{
    trial t;
    begin(&t, slant, radius, dry);
    const figures f = run(&t, 3000, 50);
    CHECK(t.seen == SC_CONTROL_GOES_ON, title);
    CHECK(f.lost == 0, title);
    CHECK(f.force_rms < 0.05, title);
    CHECK(f.estimate_rms < 0.05, title);
    CHECK(f.path_rms < path, title);
    CHECK(f.peak < 2.7, title);
    CHECK(t.control.sample.index > 2000.0f, title);
    CHECK(t.control.sample.stage == 2, title);
}

/* Gap and place by the contour against the circle itself, a tip 3 mm beside the contour's point. */
static void check_geometry(void)
{
    const char *title = "geometry";
    trial t;
    for (int i = 0; i < 40; i++) {
        const double radius = i % 2 ? 0.03 : 0.0;
        begin(&t, 0.02 * i - 0.4, radius, 0.0);
        double nx, ny, x, y;
        t.truth.advance += 3e-3;
        const double gap = gap_of(&t.truth, &nx, &ny);
        tip_of(&t.truth, &x, &y);
        t.last_opening = (float)t.truth.opening;
        tick(&t);
        const sc_control_sample *sample = &t.control.sample;
        NEAR((double)sample->tip_x, x, 2e-6, "tip x", title);
        NEAR((double)sample->tip_y, y, 2e-6, "tip y", title);
        NEAR((double)sample->gap, gap, 2e-6, "gap", title);
        const sc_contour then = t.task.contour;
        look_at(&t);
        NEAR((double)sample->place, (double)t.task.contour.place, 2e-6, "place", title);
        CHECK(t.task.contour.number == then.number + 1, title);
    }
}

static void check_friction(void)
{
    const char *title = "friction";
    sc_axis_friction friction;
    flat_friction(&friction, 0.0f);
    for (int i = 0; i < SC_FRICTION_POINTS; i++) {
        const float share = (float)i / (float)(SC_FRICTION_POINTS - 1);
        friction.positive[i] = 1.0f + share;        /* 1 + the fourth root of its share */
        friction.negative[i] = 3.0f;
    }
    friction.slope = 0.5f;
    friction.bend = -2.0f;
    friction.centre = 0.4f;
    NEAR((double)sc_axis_friction_at(&friction, 0.4f, 0.125f), 1.5, 1e-6, "a sixteenth's root", title);
    NEAR((double)sc_axis_friction_at(&friction, 0.4f, 99.0f), 2.0, 1e-6, "held beyond", title);
    NEAR((double)sc_axis_friction_at(&friction, 0.6f, -0.1f), 3.0 * (1.0 + 0.1 - 0.08), 1e-5,
         "by place", title);
    NEAR((double)sc_axis_friction_at(&friction, 9.0f, 0.1f), 0.0, 0.0, "never below 0", title);
}

/* A plate that rises is followed; so is one that a reader learns of late, from its speed. */
static void check_moving_plate(void)
{
    const char *title = "moving plate";
    trial t;
    begin(&t, 0.05, 0.0, 0.01);
    t.truth.plate_speed = 4e-3;
    const figures f = run(&t, 3000, 50);
    CHECK(t.seen == SC_CONTROL_GOES_ON, title);
    CHECK(f.force_rms < 0.1, title);
    CHECK(f.lost == 0, title);
}

static int ended_by(trial *t, int ticks, int contours)
{
    for (int i = 0; i < ticks && t->seen == SC_CONTROL_GOES_ON; i++) {
        if (contours && i % 50 == 0) {
            look_at(t);
        }
        tick(t);
    }
    CHECK(t->seen == SC_CONTROL_GOES_ON || (t->effort[0] == 0.0f && t->effort[1] == 0.0f), "ends");
    return t->seen;
}

static void check_ends(void)
{
    trial t;
    begin(&t, 0.05, 0.0, 0.01);
    t.truth.removed = 1;
    CHECK(ended_by(&t, 5000, 1) == SC_CONTROL_NO_SURFACE, "no surface");
    CHECK(t.control.sample.gap < -t.config.away, "no surface");

    begin(&t, 0.05, 0.0, 0.01);
    run(&t, 1500, 50);
    t.truth.removed = 1;
    CHECK(ended_by(&t, 3000, 1) == SC_CONTROL_NO_SURFACE, "removed while pressed");
    CHECK(t.truth.rate > -4.0, "removed while pressed");

    begin(&t, 0.05, 0.0, 0.01);
    run(&t, 1500, 50);
    t.handle = 2.0f;
    CHECK(ended_by(&t, 49, 1) == SC_CONTROL_GOES_ON, "a knock at the handle");
    CHECK(ended_by(&t, 10, 1) == SC_CONTROL_HANDLE, "handle held");

    begin(&t, 0.05, 0.0, 0.01);
    run(&t, 1500, 50);
    t.config.force_stop = 1.5f;
    CHECK(ended_by(&t, 200, 0) == SC_CONTROL_PRESSED, "pressed");

    begin(&t, 0.05, 0.0, 0.01);
    t.task.contour.point[1] -= 5e-3f;
    CHECK(ended_by(&t, 3000, 0) == SC_CONTROL_AWAY || t.seen == SC_CONTROL_NO_CONTOUR, "away");
    begin(&t, 0.05, 0.0, 0.01);
    t.config.end_s = 10.0f;
    t.config.stale_s = 10.0f;
    t.task.contour.point[1] -= 5e-3f;
    CHECK(ended_by(&t, 3000, 0) == SC_CONTROL_AWAY, "away");

    begin(&t, 0.0, 0.0, 0.01);
    t.config.least_lever = 0.05f;
    CHECK(ended_by(&t, 10, 1) == SC_CONTROL_REFUSED, "no lever");

    begin(&t, 0.0, 0.0, 0.01);
    t.measured_gain = NAN;
    CHECK(ended_by(&t, 10, 1) == SC_CONTROL_REFUSED, "no measured torque");

    begin(&t, 0.05, 0.0, 0.01);
    t.truth.dry_force = 30.0; /* the sledge is stuck */
    CHECK(ended_by(&t, 4000, 1) == SC_CONTROL_PATH_LOST, "path lost");

    begin(&t, 0.05, 0.0, 0.01);
    t.task.contour.number = 0;
    CHECK(ended_by(&t, 900, 0) == SC_CONTROL_GOES_ON && t.effort[0] == 0.0f, "no contour yet");
    CHECK(ended_by(&t, 200, 0) == SC_CONTROL_NO_CONTOUR, "no contour at all");
}

/* Without contours the force falls, the tip is lifted and waits; the path with it. With the next one it
 * goes on. Without any for end_s the mode ends. */
static void check_stale(void)
{
    const char *title = "stale";
    trial t;
    begin(&t, 0.05, 0.0, 0.01);
    run(&t, 1500, 50);
    CHECK(t.truth.pressed > 1.5, title);
    CHECK(ended_by(&t, 600, 0) == SC_CONTROL_GOES_ON, title);
    CHECK(t.truth.pressed == 0.0, title);
    CHECK(t.control.sample.flags & SC_CONTROL_LIFTED, title);
    NEAR((double)t.control.sample.gap, 3e-3, 1e-3, "lifted by", title);
    const float waits = t.control.sample.index;
    CHECK(ended_by(&t, 100, 0) == SC_CONTROL_GOES_ON, title);
    CHECK(t.control.sample.index == waits, title);
    CHECK(ended_by(&t, 2000, 1) == SC_CONTROL_GOES_ON, title);
    CHECK(t.truth.pressed > 1.5, title);
    CHECK(t.control.sample.index > waits + 500.0f, title);
    t.task.contour.lift = 1;
    CHECK(ended_by(&t, 600, 1) == SC_CONTROL_GOES_ON, "lift");
    CHECK(t.truth.pressed == 0.0, "lift");
    t.task.contour.lift = 0;
    CHECK(ended_by(&t, 2000, 0) == SC_CONTROL_NO_CONTOUR, title);
}

/* A motor that turns the wrong way is not followed into a runaway of the estimate. */
static void check_held(void)
{
    const char *title = "held";
    sc_balance balance;
    memset(&balance, 0, sizeof balance);
    trial t;
    begin(&t, 0.0, 0.0, 0.015);
    sc_control_tick at = {1e-3f, 0.5f, 0.0f, 0.0f, 0.0f, -0.014f, 0.0f};
    for (int i = 0; i < 300; i++) {
        NEAR((double)sc_balance_take(&t.config, &balance, &at, 0.0f, 0.035f), 0.0, 1e-6,
             "friction holds", title);
    }
    const float sd = sc_balance_sd(&t.config, &balance);
    CHECK(sd > t.config.torque_sd, title);
    at.motor_torque = -0.05f; /* more than friction holds: the rest is pressed */
    float torque = 0.0f;
    for (int i = 0; i < 300; i++) {
        torque = sc_balance_take(&t.config, &balance, &at, 0.0f, 0.035f);
    }
    NEAR((double)torque, 0.05 - 1.1 * 0.015, 1e-4, "beyond what holds", title);
    for (int i = 0; i < 700; i++) {
        sc_balance_take(&t.config, &balance, &at, 0.0f, 0.035f);
    }
    NEAR((double)sc_balance_sd(&t.config, &balance), hypot(1e-3, 0.015 / sqrt(3.0)), 1e-5,
         "unknown within friction", title);
}

static void check_configs(void)
{
    const char *title = "configuration";
    trial t;
    begin(&t, 0.0, 0.0, 0.01);
    CHECK(sc_control_config_is_sound(&t.config), title);
    t.config.moving_blades = 3.0f;
    CHECK(!sc_control_config_is_sound(&t.config), title);
    begin(&t, 0.0, 0.0, 0.01);
    t.config.opening.negative[3] = NAN;
    CHECK(!sc_control_config_is_sound(&t.config), title);
    begin(&t, 0.0, 0.0, 0.01);
    t.config.law.axes = 3;
    CHECK(!sc_control_config_is_sound(&t.config), title);
    begin(&t, 0.0, 0.0, 0.01);
    t.config.presliding = 0.0f;
    CHECK(!sc_control_config_is_sound(&t.config), title);
    begin(&t, 0.0, 0.0, 0.01);
    t.config.away = INFINITY;
    CHECK(!sc_control_config_is_sound(&t.config), title);
}

static void check_block(void)
{
    const char *title = "block";
    sc_control_block *block = calloc(1, sizeof *block);
    sc_contour contour, got;
    memset(&contour, 0, sizeof contour);
    memset(&got, 0, sizeof got);
    CHECK(sc_control_block_receive(block, &got) && got.number == 0, title);
    contour.place = 7.0f;
    sc_control_block_send(block, &contour);
    CHECK(sc_control_block_receive(block, &got) && got.number == 1 && got.place == 7.0f, title);
    block->lock++; /* being written */
    contour.place = 8.0f;
    CHECK(!sc_control_block_receive(block, &got) && got.place == 7.0f, title);
    block->lock++;
    sc_control_sample sample, read[100];
    memset(&sample, 0, sizeof sample);
    for (uint32_t i = 0; i < SC_CONTROL_RING + 50; i++) {
        sample.sequence = i;
        sc_control_block_push(block, &sample);
    }
    uint64_t cursor = 0, lost = 0;
    CHECK(sc_control_block_read(block, &cursor, read, 100, &lost) == 100, title);
    CHECK(lost == 51 && read[0].sequence == 51 && read[99].sequence == 150, title);
    free(block);
}

int main(void)
{
    check_geometry();
    check_friction();
    check_run("frictionless plane", 0.0, 0.0, 0.0, 1e-4);
    check_run("plane pitched by 6 deg", 0.105, 0.0, 0.0, 1e-4);
    check_run("plane with friction", 0.105, 0.0, 0.015, 3e-4);
    check_run("level plane with friction", 0.0, 0.0, 0.015, 3e-4);
    check_run("circle", 0.0, 0.04, 0.0, 1e-4);
    check_run("circle with friction", 0.0, 0.04, 0.015, 3e-4);
    check_moving_plate();
    check_ends();
    check_stale();
    check_held();
    check_configs();
    check_block();
    return checks_done("control");
}
