/* The measure for the closed loop: the same algorithm in C, one plant and blocks of LANES plants.

   PID position loop (observer form of degree 2), PI force loop with clipping, linear actuator,
   asymmetric Karnopp plant by exact steps with located switches. gcc -O3 -march=native
   Also a loop of ten Euler sub-steps a sample, which is what one would write first. */
#include <math.h>
#include <stddef.h>

#define ORDER 11
#define RATE_STEP 0.35
#define LANES 16

enum { STUCK, SLIP_P, SLIP_N, BAND_P, BAND_N, EDGE_P, EDGE_N, MODES };
enum { M, F_CP, F_CN, F_VP, F_VN, DV_P, DV_N, F_SP, F_SN, K1, K2, PARAMETERS };

typedef struct {
    double a11, a12, b1, p1, p2, p3, c, v_lo, v_hi, f_lo, f_hi, l1, l2;
} row_t;

enum { A11, A12, B1, P1, P2, P3, C, V_LO, V_HI, F_LO, F_HI, L1, L2 };

typedef struct {
    double h, r0, r1, r2, s1, s2, k_p, k_int, limit;
} loop_t;

typedef struct {
    double y, v, f;
    int mode;
} state_t;

typedef struct {
    double dy, v, a;
} motion_t;

static inline void series(double v, double phi, double g, double alpha, double beta, double w,
                          double *c)
{
    c[0] = v;
    c[1] = w * phi - alpha * v;
    c[2] = 0.5 * (w * g - beta * v - alpha * c[1]);
#pragma GCC unroll 16
    for (int k = 3; k <= ORDER; k++)
        c[k] = -(beta * (1.0 / (k * (k - 1)))) * c[k - 2] - alpha * (1.0 / k) * c[k - 1];
}

static inline double power_sum(const double *c, double t)
{
    double t2 = t * t, t4 = t2 * t2;
    double low = (c[0] + c[1] * t) + (c[2] + c[3] * t) * t2;
    double middle = (c[4] + c[5] * t) + (c[6] + c[7] * t) * t2;
    double high = (c[8] + c[9] * t) + (c[10] + c[11] * t) * t2;
    return low + (middle + high * t4) * t4;
}

static inline motion_t motion(const double *c, double t)
{
    double travel[ORDER + 1], slope[ORDER + 1];
#pragma GCC unroll 16
    for (int k = 0; k <= ORDER; k++) {
        travel[k] = c[k] * (1.0 / (k + 1));
        slope[k] = k < ORDER ? (k + 1) * c[k + 1] : 0.0;
    }
    return (motion_t){t * power_sum(travel, t), power_sum(c, t), power_sum(slope, t)};
}

/* First time in [0, high] at which at_0 + g t - k2 dy + w v falls through 0, and dy until then. */
static double fall(const double *c, double at_0, double g, double k2, double w, double end,
                   double high, double *moved)
{
    double value = at_0 + w * c[0], slope = g - k2 * c[0] + w * c[1];
    *moved = 0.0;
    if (value <= 0.0 && slope <= 0.0)
        return 0.0;
    double q = (end - value - slope * high) / (high * high);
    double root = sqrt(fmax(0.0, slope * slope - 4.0 * q * value));
    double tau = slope <= 0.0 ? 2.0 * value / (root - slope) : (slope + root) / (-2.0 * q);
    if (!(tau > 0.0 && tau < high))
        tau = 0.5 * high;
    double low = 0.0, top = high;
    for (int i = 0; i < 80; i++) {
        motion_t at = motion(c, tau);
        *moved = at.dy;
        value = at_0 + g * tau - k2 * at.dy + w * at.v;
        slope = g - k2 * at.v + w * at.a;
        if (value > 0.0)
            low = tau;
        else
            top = tau;
        if (slope < 0.0) {
            double change = -value / slope;
            double bend = change * (w * (c[2] + 3.0 * c[3] * tau) - 0.5 * k2 * at.a) / slope;
            if ((fabs(change) <= 1e-5 * high && fabs(bend) <= 1e-6) ||
                fabs(change) <= 1e-15 + 1e-13 * high) {
                change -= change * bend;
                *moved = at.dy + change * (at.v + 0.5 * at.a * change);
                return tau + change;
            }
            tau += change;
        }
        if (slope >= 0.0 || !(tau > low && tau < top))
            tau = 0.5 * (low + top);
    }
    return tau;
}

static int sliding_exit(int slip, double v, double force, double g, double left, double m,
                        double coulomb, double viscous, double edge, double stick, double k2,
                        double *tau, double *moved, double *v_end)
{
    double c[ORDER + 1], w = 1.0 / m, alpha = slip ? viscous * w : 0.0, beta = k2 * w, span = left;
    if (alpha * left > RATE_STEP || beta * left * left > RATE_STEP * RATE_STEP)
        span = fmin(left, RATE_STEP / fmax(alpha, sqrt(beta)));
    series(v, force - (slip ? coulomb : stick), g, alpha, beta, w, c);
    motion_t at = motion(c, span);
    *tau = span, *moved = at.dy, *v_end = at.v;
    if (slip) {
        double high = span, end = at.v;
        if (end >= edge && c[1] < 0.0 && at.a > 0.0 && v + c[1] * span < edge) {
            double low = 0.0;
            for (int i = 0; i < 50; i++) {
                double middle = 0.5 * (low + high);
                if (motion(c, middle).a < 0.0)
                    low = middle;
                else
                    high = middle;
            }
            high = 0.5 * (low + high);
            end = motion(c, high).v;
        }
        if (end >= edge)
            return 0;
        *tau = fall(c, -edge, 0.0, 0.0, 1.0, end - edge, high, moved);
        *v_end = edge;
        return 1;
    }
    int found = 0;
    double excess = force - stick, end = excess + g * span - k2 * at.dy;
    if (end < 0.0) {
        *tau = fall(c, excess, g, k2, 0.0, end, span, moved);
        *v_end = power_sum(c, *tau), found = 2;
    }
    if (*v_end > edge) {
        *tau = fall(c, edge, 0.0, 0.0, -1.0, edge - *v_end, *tau, moved);
        *v_end = edge, found = 1;
    }
    return found;
}

static __attribute__((noinline)) state_t resolve(const double *p, state_t s, double g, double h)
{
    double left = h, k2 = p[K2];
    for (int i = 0; i < 200 && left > 0.0; i++) {
        if (s.mode == STUCK || s.mode == EDGE_P || s.mode == EDGE_N) {
            double low, high, slope = g - k2 * s.v, tau = left;
            int below, above, next = s.mode;
            if (s.mode == STUCK)
                low = p[F_SN], high = p[F_SP], below = BAND_N, above = BAND_P;
            else if (s.mode == EDGE_P)
                low = p[F_SP], high = p[F_CP] + p[F_VP] * p[DV_P], below = STUCK, above = SLIP_P;
            else
                low = -p[F_CN] + p[F_VN] * p[DV_N], high = p[F_SN], below = SLIP_N, above = STUCK;
            if (s.f + slope * left > high)
                tau = fmax(0.0, (high - s.f) / slope), next = above;
            else if (s.f + slope * left < low)
                tau = fmax(0.0, (low - s.f) / slope), next = below;
            s.y += s.v * tau;
            s.f += slope * tau;
            left -= tau;
            if (next == STUCK)
                s.v = 0.0;
            s.mode = next;
            continue;
        }
        int up = s.mode == SLIP_P || s.mode == BAND_P, slip = s.mode == SLIP_P || s.mode == SLIP_N;
        double side = up ? 1.0 : -1.0, tau, moved, v;
        int found = sliding_exit(slip, side * s.v, side * s.f, side * g, left, p[M],
                                 up ? p[F_CP] : p[F_CN], up ? p[F_VP] : p[F_VN],
                                 up ? p[DV_P] : -p[DV_N], up ? p[F_SP] : -p[F_SN], k2, &tau, &moved,
                                 &v);
        s.v = side * v;
        s.y += side * moved;
        s.f += g * tau - k2 * side * moved;
        left -= tau;
        if (found == 2) {
            s.v = 0.0, s.mode = STUCK;
        } else if (found == 1 && up) {
            s.v = p[DV_P];
            if (s.f > p[F_SP])
                s.mode = !slip && s.f >= p[F_CP] + p[F_VP] * p[DV_P] ? SLIP_P : EDGE_P;
            else if (s.f >= p[F_SN])
                s.v = 0.0, s.mode = STUCK;
            else
                s.mode = BAND_N;
        } else if (found == 1) {
            s.v = p[DV_N];
            if (s.f < p[F_SN])
                s.mode = !slip && s.f <= -p[F_CN] + p[F_VN] * p[DV_N] ? SLIP_N : EDGE_N;
            else if (s.f <= p[F_SP])
                s.v = 0.0, s.mode = STUCK;
            else
                s.mode = BAND_P;
        }
    }
    return s;
}

/* tables: (MODES, 13) as `row_t`, made once by the caller; out: y, v, F, u by n. */
void loop_one(const double *p, const row_t *tables, const loop_t *loop, const double *feed,
              const double *noise_y, const double *noise_f, size_t n, double *restrict out,
              long *restrict modes)
{
    const loop_t l = *loop;
    state_t s = {0.0, 0.0, 0.0, STUCK};
    row_t row = tables[STUCK];
    double x1 = 0.0, x2 = 0.0, integral = 0.0, k1 = p[K1], k2 = p[K2];
    for (size_t k = 0; k < n; k++) {
        double measured = s.y + noise_y[k];
        double wanted = feed[k] - l.r0 * measured + x1;
        double error = wanted - (s.f + noise_f[k]), free = l.k_p * error + integral;
        double u = free > l.limit ? l.limit : free < -l.limit ? -l.limit : free;
        integral += l.k_int * ((free - u) * error > 0.0 ? 0.0 : error);
        x1 = x2 - l.r1 * measured - l.s1 * wanted;
        x2 = -l.r2 * measured - l.s2 * wanted;
        out[k] = s.y, out[n + k] = s.v, out[2 * n + k] = s.f, out[3 * n + k] = u;
        modes[k] = s.mode;
        double g = k1 * u, phi = s.f - row.c;
        double moved = row.p1 * s.v + row.p2 * phi + row.p3 * g;
        double v = row.a11 * s.v + row.a12 * phi + row.b1 * g;
        double f = s.f + g * l.h - k2 * moved, bound = row.l1 * s.v + row.l2 * phi;
        int left = (v < row.v_lo) | (v > row.v_hi) | (bound < row.v_lo) | (bound > row.v_hi) |
                   (f < row.f_lo) | (f > row.f_hi);
        if (left) {
            s = resolve(p, s, g, l.h);
            row = tables[s.mode];
        } else {
            s.y += moved, s.v = v, s.f = f;
        }
    }
}

typedef struct {
    double row[13][LANES]; /* in the order of row_t */
    double y[LANES], v[LANES], f[LANES], g[LANES], k1[LANES], k2[LANES];
    double y_old[LANES], v_old[LANES], f_old[LANES];
    double x1[LANES], x2[LANES], integral[LANES], errors[LANES], commands[LANES];
    long left[LANES];
} __attribute__((aligned(64))) block_t;

static void load_mode(block_t *b, int i, const row_t *row)
{
    const double *from = (const double *)row;
    for (int j = 0; j < 13; j++)
        b->row[j][i] = from[j];
}

/* Sums of squared error and command of `plants` loops, a multiple of LANES, into costs (2, plants);
   p: (plants, 11), tables: (plants, MODES, 13). */
void loop_many(const double *p, const row_t *tables, const loop_t *loop, const double *reference,
               const double *feed, const double *noise_y, const double *noise_f, size_t n,
               size_t plants, double *costs)
{
    const loop_t l = *loop;
    for (size_t base = 0; base < plants; base += LANES) {
        block_t b = {0};
        int modes[LANES] = {0};
        for (int i = 0; i < LANES; i++) {
            load_mode(&b, i, &tables[(base + i) * MODES]);
            b.k1[i] = p[(base + i) * PARAMETERS + K1];
            b.k2[i] = p[(base + i) * PARAMETERS + K2];
        }
        for (size_t k = 0; k < n; k++) {
            const double r = reference[k], fed = feed[k], n_y = noise_y[k], n_f = noise_f[k];
            long any = 0;
            for (int i = 0; i < LANES; i++) {
                double y = b.y[i], v = b.v[i], f = b.f[i];
                double measured = y + n_y, wanted = fed - l.r0 * measured + b.x1[i];
                double error = wanted - (f + n_f), free = l.k_p * error + b.integral[i];
                double u = free > l.limit ? l.limit : free;
                u = u < -l.limit ? -l.limit : u;
                b.integral[i] += l.k_int * ((free - u) * error > 0.0 ? 0.0 : error);
                b.x1[i] = b.x2[i] - l.r1 * measured - l.s1 * wanted;
                b.x2[i] = -l.r2 * measured - l.s2 * wanted;
                b.errors[i] += (r - y) * (r - y);
                b.commands[i] += u * u;
                double g = b.k1[i] * u, phi = f - b.row[C][i];
                double moved = b.row[P1][i] * v + b.row[P2][i] * phi + b.row[P3][i] * g;
                double v_next = b.row[A11][i] * v + b.row[A12][i] * phi + b.row[B1][i] * g;
                double f_next = f + g * l.h - b.k2[i] * moved;
                double bound = b.row[L1][i] * v + b.row[L2][i] * phi;
                long left = (v_next < b.row[V_LO][i]) | (v_next > b.row[V_HI][i]) | (bound < b.row[V_LO][i]) |
                            (bound > b.row[V_HI][i]) | (f_next < b.row[F_LO][i]) | (f_next > b.row[F_HI][i]);
                b.g[i] = g, b.y_old[i] = y, b.v_old[i] = v, b.f_old[i] = f;
                b.y[i] = y + moved, b.v[i] = v_next, b.f[i] = f_next;
                b.left[i] = left;
                any |= left;
            }
            if (any)
                for (int i = 0; i < LANES; i++)
                    if (b.left[i]) {
                        state_t s = {b.y_old[i], b.v_old[i], b.f_old[i], modes[i]};
                        s = resolve(&p[(base + i) * PARAMETERS], s, b.g[i], l.h);
                        b.y[i] = s.y, b.v[i] = s.v, b.f[i] = s.f;
                        if (s.mode != modes[i])
                            load_mode(&b, i, &tables[(base + i) * MODES + s.mode]);
                        modes[i] = s.mode;
                    }
        }
        for (int i = 0; i < LANES; i++)
            costs[base + i] = b.errors[i], costs[plants + base + i] = b.commands[i];
    }
}

/* The same loop with `sub` Euler steps a sample; out: y by n. */
void loop_euler(const double *p, const loop_t *loop, const double *feed, const double *noise_y,
                const double *noise_f, size_t n, int sub, double *out)
{
    const loop_t l = *loop;
    double y = 0.0, v = 0.0, f = 0.0, x1 = 0.0, x2 = 0.0, integral = 0.0, d = l.h / sub;
    for (size_t k = 0; k < n; k++) {
        double measured = y + noise_y[k], wanted = feed[k] - l.r0 * measured + x1;
        double error = wanted - (f + noise_f[k]), free = l.k_p * error + integral;
        double u = free > l.limit ? l.limit : free < -l.limit ? -l.limit : free;
        integral += l.k_int * ((free - u) * error > 0.0 ? 0.0 : error);
        x1 = x2 - l.r1 * measured - l.s1 * wanted;
        x2 = -l.r2 * measured - l.s2 * wanted;
        out[k] = y;
        for (int j = 0; j < sub; j++) {
            double friction;
            if (v >= p[DV_P])
                friction = p[F_CP] + p[F_VP] * v;
            else if (v <= p[DV_N])
                friction = -p[F_CN] + p[F_VN] * v;
            else if (f > p[F_SP])
                friction = p[F_SP];
            else if (f < p[F_SN])
                friction = p[F_SN];
            else
                friction = f, v = 0.0;
            double v_next = v + d * (f - friction) / p[M];
            f += d * (p[K1] * u - p[K2] * v);
            y += d * v;
            v = v_next;
        }
    }
}
