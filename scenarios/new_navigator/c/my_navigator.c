/* A textbook navigator for the protocol of sinssim: north-pointing, of second order with one sample a step. */
#include "sinssim_navigator.h"

static struct sinssim_begin b;
static double t, lat, lon, h, v[3], q[4], before[3], dt0[3], dv0[3];

static void cross(double *out, const double *x, const double *y, double k) { /* out += k x × y */
    out[0] += k * (x[1] * y[2] - x[2] * y[1]);
    out[1] += k * (x[2] * y[0] - x[0] * y[2]);
    out[2] += k * (x[0] * y[1] - x[1] * y[0]);
}
static void resolve(double sign, const double *x, double *out) { /* body to north, east, down; back for -1 */
    double u[3] = {sign * q[1], sign * q[2], sign * q[3]}, w[3] = {q[0] * x[0], q[0] * x[1], q[0] * x[2]};
    cross(w, u, x, 1.0);
    memcpy(out, x, 3 * sizeof *x);
    cross(out, u, w, 2.0);
}
static void turn(const double *r) { /* the body by a rotation vector */
    double a = sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2]), w = cos(0.5 * a), s = a < 1e-8 ? 0.5 : sin(0.5 * a) / a;
    double x = s * r[0], y = s * r[1], z = s * r[2], p[4] = {q[0], q[1], q[2], q[3]};
    q[0] = p[0] * w - p[1] * x - p[2] * y - p[3] * z;
    q[1] = p[0] * x + p[1] * w + p[2] * z - p[3] * y;
    q[2] = p[0] * y - p[1] * z + p[2] * w + p[3] * x;
    q[3] = p[0] * z + p[1] * y - p[2] * x + p[3] * w;
}
static int navigator_begin(const struct sinssim_begin *begin, const struct sinssim_sensor *sensors) {
    (void)sensors;
    b = *begin;
    t = b.time_s, lat = b.state[0], lon = b.state[1], h = b.state[2];
    memcpy(v, b.state + 3, sizeof v), memcpy(before, v, sizeof v), memcpy(q, b.state + 6, sizeof q);
    return b.rates; /* increments are wanted */
}
static void navigator_sample(const struct sinssim_sample *s) {
    double a = b.ellipsoid[0], f = b.ellipsoid[1], e2 = f * (2 - f), spin = b.ellipsoid[3], dt = s->interval;
    double m = spin * spin * a * a * a * (1 - f) / b.ellipsoid[2], sine = sin(lat), root = sqrt(1 - e2 * sine * sine);
    double rn = a / root + h, rm = a * (1 - e2) / (root * root * root) + h, mid[3], r[3], d[3], fn[3], wide[3], old[3];
    double g = b.gravity_equator * (1 + b.gravity_k * sine * sine) / root *
               (1 - 2 * h / a * (1 + f + m - 2 * f * sine * sine) + 3 * h * h / a / a);
    int k;
    for (k = 0; k < 3; k++) mid[k] = v[k] + 0.5 * (v[k] - before[k]), old[k] = v[k]; /* in the middle of the step */
    double rate[3] = {spin * cos(lat) + mid[1] / rn, -mid[0] / rm, -spin * sine - mid[1] * tan(lat) / rn};
    wide[0] = rate[0] + spin * cos(lat), wide[1] = rate[1], wide[2] = rate[2] - spin * sine;
    memcpy(r, s->gyro, sizeof r), cross(r, dt0, s->gyro, 1.0 / 12.0); /* coning */
    memcpy(d, s->accel, sizeof d), cross(d, s->gyro, s->accel, 0.5);  /* rotation, sculling */
    cross(d, dt0, s->accel, 1.0 / 12.0), cross(d, dv0, s->gyro, 1.0 / 12.0);
    memcpy(dt0, s->gyro, sizeof dt0), memcpy(dv0, s->accel, sizeof dv0);
    resolve(1.0, d, fn);
    memcpy(d, fn, sizeof d), cross(fn, rate, d, -0.5 * dt);
    for (k = 0; k < 3; k++) v[k] += fn[k];
    v[2] += g * dt, cross(v, wide, mid, -dt);
    memcpy(before, old, sizeof before);
    lat += 0.5 * (old[0] + v[0]) / rm * dt;
    lon += 0.5 * (old[1] + v[1]) / (rn * cos(lat)) * dt;
    h -= 0.5 * (old[2] + v[2]) * dt;
    turn(r);
    for (k = 0; k < 3; k++) r[k] = -rate[k] * dt;
    resolve(-1.0, r, d), turn(d);
    t = s->time;
}
static void navigator_measurement(unsigned sensor, double arrival, double time, const double *value, const double *sigma) {
    (void)sensor, (void)arrival, (void)time, (void)value, (void)sigma; /* a filter would use it */
}
static void navigator_solution(struct sinssim_solution *solution) {
    double state[10] = {lat, lon, h, v[0], v[1], v[2], q[0], q[1], q[2], q[3]};
    solution->time = t;
    memcpy(solution->state, state, sizeof state);
}
