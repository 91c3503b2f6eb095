/* Version 1 of sinssim's protocol for navigators, for C and C++: docs/foreign-navigators.md describes the messages.
 *
 * You write the four functions navigator_...; this file makes of them, on a little-endian machine,
 *   a shared library:  cc -O2 -shared -fPIC -o libmy_navigator.so my_navigator.c -lm
 *   a program:         cc -O2 -DSINSSIM_PROGRAM -o my_navigator my_navigator.c -lm
 * All quantities are SI: rad, m, m/s, s. Axes: north, east, down; forward, right, down. Quaternions: scalar first, from
 * body to north, east, down. */
#ifndef SINSSIM_NAVIGATOR_H
#define SINSSIM_NAVIGATOR_H
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define SINSSIM_VERSION 1u

struct sinssim_begin {               /* the first message */
    double epoch_gps_s;              /* GPS time of the time 0 */
    double time_s;                   /* of the initial state */
    double state[10];                /* latitude, longitude, height; velocity; quaternion */
    double state_sigma[9];           /* 1 sigma north, east, down of position, velocity and attitude */
    double imu_rate_hz;
    double gyro_noise[3], accel_noise[3];             /* random walk of angle, rad/sqrt(s), and velocity */
    double gyro_bias[3], accel_bias[3];               /* 1 sigma */
    double gyro_walk[3], accel_walk[3];               /* random walk of the biases, rad/s/sqrt(s) */
    double gyro_instability[3], accel_instability[3]; /* 1 sigma of their variation, with the time constants */
    double correlation_s[2];
    double gyro_scale[3], accel_scale[3];             /* 1 sigma of the scale factors */
    double quantum[2];                                /* one pulse, rad and m/s */
    double ellipsoid[4];                              /* a, f, GM, rotation rate */
    double gravity_equator, gravity_k;                /* normal gravity at the equator, constant of Somigliana */
    char gravity[16];                                 /* the model that sinssim's own navigators use */
    uint32_t rates, stepwise, sensors, zero;          /* rates: samples are means over their intervals */
};
struct sinssim_sensor {
    char name[32], kind[32];
    double lever_arm[3];             /* from the sensor block, forward, right, down */
    uint32_t values, sigmas;         /* counts in each measurement */
};
struct sinssim_sample {
    double time, interval;           /* its end and its duration */
    double gyro[3], accel[3];        /* integrals over the interval, or means */
};
struct sinssim_solution {
    double time, state[10];
    double sigma[9], bias[6], status; /* NaN: not stated */
};

/* Yours. A status other than 0 of the first refuses to begin. */
static int navigator_begin(const struct sinssim_begin *begin, const struct sinssim_sensor *sensors);
static void navigator_sample(const struct sinssim_sample *sample);
static void navigator_measurement(unsigned sensor, double arrival, double time, const double *value, const double *sigma);
static void navigator_solution(struct sinssim_solution *solution); /* after each sample and what arrives with it */

struct sinssim_head {
    uint16_t kind, index;
    uint32_t size;
};
static struct sinssim_sensor sinssim_sensors[64];
static unsigned sinssim_waiting; /* measurements that still belong to the last sample */

/* Take one message; return the bytes of the answer. The first answer decides whether more than the state is sent. */
static size_t sinssim_take(struct sinssim_head head, const void *data, char *answer) {
    const double *numbers = (const double *)data;
    static struct sinssim_head mine = {6, 0, 0};
    struct sinssim_solution solution;
    int k;
    if (head.kind == 3) {
        navigator_sample((const struct sinssim_sample *)data);
        sinssim_waiting = head.index;
    } else if (head.kind == 4) {
        navigator_measurement(head.index, numbers[0], numbers[1], numbers + 2, numbers + 2 + sinssim_sensors[head.index].values);
        sinssim_waiting--;
    } else {
        return 0;
    }
    if (sinssim_waiting) return 0;
    for (k = 0; k < 9; k++) solution.sigma[k] = NAN;
    for (k = 0; k < 6; k++) solution.bias[k] = NAN;
    solution.status = NAN;
    navigator_solution(&solution);
    if (!mine.size) mine.size = isnan(solution.sigma[0]) && isnan(solution.bias[0]) && isnan(solution.status) ? 88 : 216;
    memcpy(answer, &mine, sizeof mine);
    memcpy(answer + sizeof mine, &solution, mine.size);
    return sizeof mine + mine.size;
}

#ifndef SINSSIM_PROGRAM /* the four functions of a library */
#ifdef __cplusplus
extern "C" {
#endif
uint32_t sinssim_version(void) { return SINSSIM_VERSION; }

/* Take the header, the first message and those of the sensors. */
int sinssim_begin(const char *data, uint64_t bytes) {
    static struct sinssim_begin begin;
    struct sinssim_head head;
    uint64_t at = 16;
    while (at < bytes) {
        memcpy(&head, data + at, sizeof head);
        at += sizeof head;
        if (head.kind == 1 && head.size == sizeof begin) memcpy(&begin, data + at, sizeof begin);
        if (head.kind == 2 && head.index < 64) memcpy(&sinssim_sensors[head.index], data + at, sizeof *sinssim_sensors);
        at += head.size;
    }
    return begin.sensors > 64 ? 1 : navigator_begin(&begin, sinssim_sensors);
}

/* Take messages, write answers with their heads; return their bytes, or a negative number. */
int64_t sinssim_block(const char *data, uint64_t bytes, char *answers, uint64_t most) {
    const char *end = data + bytes;
    struct sinssim_head head;
    int64_t written = 0;
    for (; data < end; data += head.size) {
        memcpy(&head, data, sizeof head);
        data += sizeof head;
        if ((uint64_t)written + 8 + sizeof(struct sinssim_solution) > most) return -1;
        written += (int64_t)sinssim_take(head, data, answers + written);
    }
    return written;
}

void sinssim_end(void) {}
#ifdef __cplusplus
}
#endif
#else /* a program that reads standard input and writes standard output */
#include <unistd.h>
int main(void) {
    static struct sinssim_begin begin;
    static char in[1 << 18], out[1 << 18], header[16] = {'S', 'I', 'N', 'S', 'S', 'I', 'M', 0, SINSSIM_VERSION};
    size_t have = 16, used = 16, filled = 16, done;
    struct sinssim_head head;
    ssize_t more;
    unsigned sensors = 0;
    memcpy(out, header, 16);
    for (have = 0; have < 16; have += (size_t)more) {
        if ((more = read(0, in + have, sizeof in - have)) <= 0) return 1;
    }
    if (memcmp(in, header, 16)) return fprintf(stderr, "another version of the protocol\n"), 1;
    for (;;) {
        while (have - used >= sizeof head && (memcpy(&head, in + used, sizeof head), have - used >= sizeof head + head.size)) {
            const char *data = in + used + sizeof head;
            used += sizeof head + head.size;
            if (head.kind == 1) memcpy(&begin, data, sizeof begin);
            if (head.kind == 2 && head.index < 64) memcpy(&sinssim_sensors[head.index], data, sizeof *sinssim_sensors), sensors++;
            if (head.kind <= 2 && sensors == begin.sensors && navigator_begin(&begin, sinssim_sensors)) return 1;
            if (sizeof out - filled < 512) { /* write what has gathered */
                for (done = 0; done < filled; done += (size_t)more)
                    if ((more = write(1, out + done, filled - done)) < 0) return 1;
                filled = 0;
            }
            filled += sinssim_take(head, data, out + filled);
        }
        for (done = 0; done < filled; done += (size_t)more)
            if ((more = write(1, out + done, filled - done)) < 0) return 1;
        filled = 0;
        memmove(in, in + used, have - used);
        have -= used, used = 0;
        if ((more = read(0, in + have, sizeof in - have)) <= 0) return 0;
        have += (size_t)more;
    }
}
#endif
#endif
