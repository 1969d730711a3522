/* Slow motion of one rotor pulled by one muscle, with forward sensitivities: the algorithm of
 * muscle_bayes.physics.solvers.quasi_static (play operator, ROS2 along the sliding path, play operator), its
 * derivatives written out by hand. Units: rad, N m, N, N/m, s, degrees C. */

#include <math.h>

#define WIDTH 16 /* inputs, padded so that loops over them fill vector registers */
enum { D, A, B, C, F_HYST, K_HYST, F_MODULUS, K_MODULUS, H, T_HYST, Q0, HYST0 };
#define INPUTS 12
#define EPS 1e-3
#define FLOOR 100.0
#define GAMMA (1.0 - 0.70710678118654752440)

typedef double vector[WIDTH] __attribute__((aligned(64)));
#define EACH for (int i = 0; i < WIDTH; i++)

typedef struct {
    double radius, anchor_x, anchor_y, base_length, heated, room, torque, low, high;
} rig;

/* Temperature at an instant, and what the muscle makes of it. */
typedef struct {
    double effective, offset, damper;
    int floored;
} heat;

/* A spring's tension [N], its slope, and both per its stiffness and minimum force. */
typedef struct {
    double force, slope, force_k, slope_k, force_m, slope_m;
} spring;

/* The plant at (q, hyst): lever = dL/dq and its derivatives, MODULUS, generalised force. */
typedef struct {
    double lever, lever1, lever2, force, force_q, force_s;
    spring modulus;
} state;

static heat heat_at(const rig *r, const double *p, double heater)
{
    heat t;
    t.effective = r->room + r->heated * (heater - r->room);
    t.offset = (p[A] * t.effective + p[B]) * t.effective + p[C];
    t.damper = p[H] * (t.effective + p[T_HYST]);
    t.floored = t.damper < FLOOR;
    if (t.floored)
        t.damper = FLOOR;
    return t;
}

static spring spring_at(double strain, double stiffness, double minimum, double length)
{
    spring s = {0};
    if (strain > EPS)
        s = (spring){stiffness * (strain - EPS) + minimum, stiffness, length * (strain - EPS), length,
                     1.0, 0.0};
    else if (strain > 0.0)
        s = (spring){minimum / EPS * strain, minimum / EPS, 0.0, 0.0, strain / EPS, 1.0 / EPS};
    return s;
}

static state state_at(const rig *r, const double *p, double q, double hyst, heat t)
{
    state x;
    double s = sin(q), c = cos(q), along = r->anchor_x - r->radius * c;
    double across = r->anchor_y + r->radius * s, length = sqrt(along * along + across * across);
    double inverse = 1.0 / length;
    double swing = r->radius * (r->anchor_x * s + r->anchor_y * c);
    double swing1 = r->radius * (r->anchor_x * c - r->anchor_y * s);
    x.lever = swing * inverse;
    x.lever1 = (swing1 - x.lever * x.lever) * inverse;
    x.lever2 = (-swing - 3.0 * x.lever * x.lever1) * inverse;
    double strain = (length - r->base_length) / r->base_length - t.offset - hyst;
    x.modulus = spring_at(strain, r->base_length * p[K_MODULUS], p[F_MODULUS], r->base_length);
    x.force = r->torque - x.modulus.force * x.lever;
    x.force_q = -x.modulus.slope * x.lever * x.lever / r->base_length - x.modulus.force * x.lever1;
    x.force_s = x.modulus.slope * x.lever;
    return x;
}

/* Where the rotor comes to rest (muscle_bayes.physics.solvers.play). direction 0: it stuck, 2: it
 * lies at a stop. */
static double play(const rig *r, const double *p, double q, double hyst, heat t, int *direction)
{
    state x = state_at(r, p, q, hyst, t);
    double dry = p[D], span = r->high - r->low;
    *direction = fabs(x.force) <= dry ? 0 : x.force > 0.0 ? 1 : -1;
    if (*direction == 0)
        return q;
    double sign = *direction, room = fabs((sign > 0.0 ? r->high : r->low) - q);
    double newton = x.force_q < 0.0 ? (sign * x.force - dry) / -x.force_q : 0.0;
    double close = q + sign * fmin(newton, room);
    state y = state_at(r, p, close, hyst, t);
    double correction = (sign * dry - y.force) / (y.force_q < 0.0 ? y.force_q : 1.0);
    double left = newton > 0.0 ? fabs(correction * correction * correction) / (newton * newton) : 1.0;
    double root = close + correction;
    if (!(x.force_q < 0.0 && y.force_q < 0.0 && fabs(correction) <= 0.05 * newton &&
          left <= 1e-8 * span && newton < room && fabs(root - q) < room)) {
        double reach = fmin(fmin(fmax(2.0 * newton, 1e-11 * span), 0.02 * span), 0.5 * room);
        double over = 1.0;
        while (over > 0.0 && reach < room) {
            reach = fmin(2.0 * reach, room);
            over = sign * state_at(r, p, q + sign * reach, hyst, t).force - dry;
        }
        if (over > 0.0) {
            *direction = 2;
            return sign > 0.0 ? r->high : r->low;
        }
        double near = q, beyond = q + sign * reach, step = span;
        root = q;
        for (int count = 0; count < 80 && fabs(step) > 1e-11 * span && fabs(beyond - near) > 1e-11 * span;
             count++) {
            y = state_at(r, p, root, hyst, t);
            over = sign * y.force - dry;
            if (over > 0.0)
                near = root;
            else
                beyond = root;
            double next = y.force_q == 0.0 ? root : root - over / (sign * y.force_q);
            int inside = y.force_q != 0.0 && next >= fmin(near, beyond) && next <= fmax(near, beyond);
            if (!inside || (fabs(next - root) > 0.5 * fabs(step) && count > 8))
                next = 0.5 * (near + beyond);
            step = next - root;
            root = next;
        }
    }
    y = state_at(r, p, root, hyst, t);
    return y.force_q == 0.0 ? root : root - (y.force - sign * dry) / y.force_q;
}

/* d tension and d slope of MODULUS along directions (dq, dhyst) and the parameters' own axes. */
static void modulus_along(const rig *r, const state *x, heat t, const double *dq, const double *ds,
                          double *df)
{
    double by_q = x->modulus.slope * x->lever / r->base_length, slope = x->modulus.slope;
    EACH df[i] = by_q * dq[i] - slope * ds[i];
    df[A] -= slope * t.effective * t.effective;
    df[B] -= slope * t.effective;
    df[C] -= slope;
    df[K_MODULUS] += x->modulus.force_k;
    df[F_MODULUS] += x->modulus.force_m;
}

/* d q of a rotor that `play` has moved: the implicit equation force = direction * dry. */
static void play_along(const rig *r, const state *x, heat t, int direction, const double *ds, double *dq)
{
    if (direction == 0)
        return;
    if (direction == 2) {
        EACH dq[i] = 0.0;
        return;
    }
    vector zero = {0}, df;
    modulus_along(r, x, t, zero, ds, df);
    double scale = x->lever / x->force_q;
    EACH dq[i] = scale * df[i];
    dq[D] += direction / x->force_q;
}

/* HYST's rate [1/s], its derivative along the rotor's path, and the derivatives of both. */
typedef struct {
    double rate, column;
    vector drate, dcolumn;
} relaxation;

static void relax(const rig *r, const double *p, double q, double hyst, heat t, double along,
                  const double *dq, const double *ds, const double *dalong, int with_column, relaxation *g)
{
    state x = state_at(r, p, q, hyst, t);
    spring h = spring_at(hyst, r->base_length * p[K_HYST], p[F_HYST], r->base_length);
    double scale = 1.0 / (t.damper * r->base_length), by_damper = 1.0 / t.damper;
    double db_h = t.floored ? 0.0 : t.effective + p[T_HYST], db_t = t.floored ? 0.0 : p[H];
    vector df;
    modulus_along(r, &x, t, dq, ds, df);
    g->rate = (x.modulus.force - h.force) * scale;
    EACH g->drate[i] = scale * (df[i] - h.slope * ds[i]);
    g->drate[K_HYST] -= scale * h.force_k;
    g->drate[F_HYST] -= scale * h.force_m;
    g->drate[H] -= g->rate * by_damper * db_h;
    g->drate[T_HYST] -= g->rate * by_damper * db_t;
    if (!with_column)
        return;
    double stretch = x.lever / r->base_length * along - 1.0;
    g->column = (x.modulus.slope * stretch - h.slope) * scale;
    double by_q = scale * x.modulus.slope * x.lever1 / r->base_length * along;
    double by_along = scale * x.modulus.slope * x.lever / r->base_length;
    EACH g->dcolumn[i] = by_q * dq[i] + by_along * dalong[i];
    g->dcolumn[K_MODULUS] += scale * stretch * x.modulus.slope_k;
    g->dcolumn[F_MODULUS] += scale * stretch * x.modulus.slope_m;
    g->dcolumn[K_HYST] -= scale * h.slope_k;
    g->dcolumn[F_HYST] -= scale * h.slope_m;
    g->dcolumn[H] -= g->column * by_damper * db_h;
    g->dcolumn[T_HYST] -= g->column * by_damper * db_t;
}

/* The rotor's path while HYST moves: q becomes its start, the result is its slope, both with
 * derivatives (QuasiStatic._path). */
static double path(const rig *r, const double *p, double *q, double hyst, heat t, double duration,
                   double *dq, const double *ds, double *dalong)
{
    int moved, dry_side;
    double at = play(r, p, *q, hyst, t, &moved), dry = p[D];
    state x = state_at(r, p, at, hyst, t);
    spring h = spring_at(hyst, r->base_length * p[K_HYST], p[F_HYST], r->base_length);
    double scale = 1.0 / (t.damper * r->base_length);
    double speed = x.force_s * (x.modulus.force - h.force) * scale;
    double fade = fmin(-(x.modulus.slope + h.slope) * scale, 0.0);
    double slide = (*q - at) * x.force_q;
    double taking = speed * slide < 0.0 ? fmin(fabs(slide) / fabs(speed), duration) : 0.0;
    double left = duration - taking;
    double held = x.force + slide + speed * taking + speed * left / (1.0 - left * fade);
    int firm = x.force_q < 0.0 && at > r->low && at < r->high;
    EACH dalong[i] = 0.0;
    if (firm && fabs(held) <= dry)
        return 0.0;
    play_along(r, &x, t, moved, ds, dq);
    *q = at;
    if (!firm)
        return 0.0;
    dry_side = held > 0.0 ? 1 : -1;
    vector df;
    modulus_along(r, &x, t, dq, ds, df);
    double softness = -1.0 / x.force_q, excess = x.force - dry_side * dry;
    double lever2 = x.lever * x.lever / r->base_length;
    double by_q = -2.0 * x.modulus.slope * x.lever * x.lever1 / r->base_length - x.modulus.force * x.lever2;
    vector dsoft, dslope;
    EACH dslope[i] = by_q * dq[i] - x.lever1 * df[i];
    dslope[K_MODULUS] -= x.modulus.slope_k * lever2;
    dslope[F_MODULUS] -= x.modulus.slope_m * lever2;
    EACH dsoft[i] = softness * softness * dslope[i];
    double force_sq = x.modulus.slope * x.lever1 * softness;
    EACH dalong[i] = force_sq * dq[i] + x.force_s * dsoft[i];
    dalong[K_MODULUS] += x.modulus.slope_k * x.lever * softness;
    dalong[F_MODULUS] += x.modulus.slope_m * x.lever * softness;
    double pull_q = -x.modulus.force * x.lever1;
    EACH dq[i] += softness * (pull_q * dq[i] - x.lever * df[i]) + excess * dsoft[i];
    dq[D] -= softness * dry_side;
    *q = at + excess * softness;
    return x.force_s * softness;
}

static void written(double q, const double *dq, double **coordinate, double **jacobian)
{
    *(*coordinate)++ = q;
    for (int i = 0; i < INPUTS; i++)
        *(*jacobian)++ = dq[i];
}

/* Coordinates [rad] at nodes and middles of `intervals` intervals and their derivatives in the inputs.
 * time, heater [C]: nodes and middles by turns, 2 intervals + 1 of each. */
void staircase(const rig *r, const double *inputs, int intervals, const double *time,
               const double *heater, double *coordinate, double *jacobian)
{
    const double *p = inputs;
    double q = p[Q0], hyst = p[HYST0];
    vector dq = {0}, ds = {0}, dalong, dfirst, dmove, dq_late, ds_late;
    relaxation now, late;
    dq[Q0] = ds[HYST0] = 1.0;
    written(q, dq, &coordinate, &jacobian);
    for (int n = 0; n < intervals; n++) {
        double h = time[2 * n + 2] - time[2 * n];
        heat half = heat_at(r, p, heater[2 * n + 1]);
        heat end = heat_at(r, p, heater[2 * n + 2]);
        double along = path(r, p, &q, hyst, half, 0.5 * h, dq, ds, dalong);

        relax(r, p, q, hyst, half, along, dq, ds, dalong, 1, &now);
        double solve = 1.0 / (1.0 - GAMMA * h * now.column), first = solve * now.rate;
        double by_column = first * GAMMA * h;
        EACH dfirst[i] = solve * (now.drate[i] + by_column * now.dcolumn[i]);
        EACH dq_late[i] = dq[i] + h * (first * dalong[i] + along * dfirst[i]);
        EACH ds_late[i] = ds[i] + h * dfirst[i];
        relax(r, p, q + along * h * first, hyst + h * first, half, along, dq_late, ds_late, dalong, 0,
              &late);
        double second = solve * (late.rate - 2.0 * first), move = h * (1.5 * first + 0.5 * second);
        by_column = second * GAMMA * h;
        EACH dmove[i] = h * (1.5 * dfirst[i] +
                             0.5 * solve * (late.drate[i] - 2.0 * dfirst[i] + by_column * now.dcolumn[i]));

        q += 0.5 * along * move;
        hyst += move;
        EACH dq[i] += 0.5 * (dalong[i] * move + along * dmove[i]);
        EACH ds[i] += dmove[i];
        written(q, dq, &coordinate, &jacobian);

        int moved;
        q = play(r, p, q, hyst, end, &moved);
        if (moved) {
            state x = state_at(r, p, q, hyst, end);
            play_along(r, &x, end, moved, ds, dq);
        }
        written(q, dq, &coordinate, &jacobian);
    }
}
