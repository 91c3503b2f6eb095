// A textbook navigator for the protocol of sinssim: north-pointing, one sample a step, without a filter.
#include <cmath>
#include <cstring>

#include "sinssim_navigator.h"

struct Vector {
    double x, y, z;
};
static Vector operator+(Vector a, Vector b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
static Vector operator*(double k, Vector a) { return {k * a.x, k * a.y, k * a.z}; }
static Vector cross(Vector a, Vector b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }

struct Attitude { // quaternion from body to north, east, down
    double w;
    Vector v;
    Vector resolve(Vector a) const { return a + 2.0 * cross(v, cross(v, a) + w * a); }
    Attitude inverse() const { return {w, -1.0 * v}; }
    Attitude turned(Vector r) const { // the body by a rotation vector
        double angle = std::sqrt(r.x * r.x + r.y * r.y + r.z * r.z), s = angle < 1e-8 ? 0.5 : std::sin(0.5 * angle) / angle;
        double c = std::cos(0.5 * angle);
        Vector u = s * r;
        return {w * c - v.x * u.x - v.y * u.y - v.z * u.z, w * u + c * v + cross(v, u)};
    }
};

static struct sinssim_begin b;
static double t, lat, lon, h;
static Vector v;
static Attitude q;

static int navigator_begin(const struct sinssim_begin *begin, const struct sinssim_sensor *) {
    b = *begin;
    const double *s = b.state;
    t = b.time_s, lat = s[0], lon = s[1], h = s[2], v = {s[3], s[4], s[5]}, q = {s[6], {s[7], s[8], s[9]}};
    return static_cast<int>(b.rates); // increments are wanted
}
static void navigator_sample(const struct sinssim_sample *s) {
    double a = b.ellipsoid[0], f = b.ellipsoid[1], e2 = f * (2 - f), spin = b.ellipsoid[3], dt = s->interval;
    double m = spin * spin * a * a * a * (1 - f) / b.ellipsoid[2], sine = std::sin(lat), root = std::sqrt(1 - e2 * sine * sine);
    double rn = a / root + h, rm = a * (1 - e2) / (root * root * root) + h;
    double g = b.gravity_equator * (1 + b.gravity_k * sine * sine) / root *
               (1 - 2 * h / a * (1 + f + m - 2 * f * sine * sine) + 3 * h * h / a / a);
    Vector earth = {spin * std::cos(lat), 0.0, -spin * sine};
    Vector rate = earth + Vector{v.y / rn, -v.x / rm, -v.y * std::tan(lat) / rn};
    Vector gyro = {s->gyro[0], s->gyro[1], s->gyro[2]}, accel = {s->accel[0], s->accel[1], s->accel[2]};
    Vector force = q.resolve(accel + 0.5 * cross(gyro, accel)); // the body turns within the sample, and the axes do:
    Vector now = v + force + -0.5 * dt * cross(rate, force) + dt * (Vector{0.0, 0.0, g} + -1.0 * cross(rate + earth, v));
    Vector mean = 0.5 * (v + now);
    lat += mean.x / rm * dt, lon += mean.y / (rn * std::cos(lat)) * dt, h -= mean.z * dt;
    v = now, q = q.turned(gyro), q = q.turned(-dt * q.inverse().resolve(rate)), t = s->time;
}
static void navigator_measurement(unsigned, double, double, const double *, const double *) {} // a filter would use it
static void navigator_solution(struct sinssim_solution *solution) {
    double state[10] = {lat, lon, h, v.x, v.y, v.z, q.w, q.v.x, q.v.y, q.v.z};
    solution->time = t;
    std::memcpy(solution->state, state, sizeof state);
}
