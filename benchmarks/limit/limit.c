/* Hand-written closed forms and a hand-written Newton iteration: what the solvers are measured against.
 *
 * Every function takes n designs (dimension k of design i is d[k * n + i]), the cosine and sine of the crank's angle at
 * every step (cs[2 * step], cs[2 * step + 1]), the crank's velocity and acceleration, and writes rows x, y of one point,
 * with `rates` their first and second rates after them: row r of design i at a step is out[(step * rows + r) * n + i].
 * What does not close is NaN. Loops over designs are innermost and long, so that a compiler makes them vectors.
 */
#include <math.h>
#include <string.h>

#define CHUNK 512 /* designs whose numbers stay in the nearest cache */
#define INLINE static inline __attribute__((always_inline))
#define MIN(a, b) ((a) < (b) ? (a) : (b))

typedef struct { double x, y; } two;
typedef struct { two p, v, a; } moving; /* a point with its velocity and acceleration */

INLINE two minus(two p, two q) { return (two){p.x - q.x, p.y - q.y}; }
INLINE double dot(two p, two q) { return p.x * q.x + p.y * q.y; }

/* The pin r from the origin, and its rates. */
INLINE moving crank(double r, double c, double s, double w, double e) {
    two p = {r * c, r * s};
    return (moving){p, {-w * p.y, w * p.x}, {-e * p.y - w * w * p.x, e * p.x - w * w * p.y}};
}

/* The pin b from P and c from Q, to the left of the way from P to Q (side 1, else -1): one division and one root,
 * another for rates. */
INLINE moving joined(moving P, moving Q, double b2, double c2, double side, int rates) {
    two e = minus(Q.p, P.p);
    double inverse = 1.0 / dot(e, e), along = 0.5 + 0.5 * (b2 - c2) * inverse;
    double across = side * sqrt(b2 * inverse - along * along);
    two b = {along * e.x - across * e.y, along * e.y + across * e.x}, c = minus(b, e);
    moving C = {{P.p.x + b.x, P.p.y + b.y}, {0, 0}, {0, 0}};
    if (!rates) return C;
    /* (C - P)(C' - P') = 0 and (C - Q)(C' - Q') = 0, and these two differentiated */
    double whole = 1.0 / (b.x * c.y - b.y * c.x), f = dot(b, P.v), g = dot(c, Q.v);
    C.v = (two){(f * c.y - g * b.y) * whole, (g * b.x - f * c.x) * whole};
    two u = minus(C.v, P.v), v = minus(C.v, Q.v);
    f = dot(b, P.a) - dot(u, u), g = dot(c, Q.a) - dot(v, v);
    C.a = (two){(f * c.y - g * b.y) * whole, (g * b.x - f * c.x) * whole};
    return C;
}

INLINE moving dyad(moving P, moving Q, double b2, double c2, int rates) { return joined(P, Q, b2, c2, 1.0, rates); }

INLINE void put(double *restrict at, long n, moving C, int rates) {
    at[0] = C.p.x, at[n] = C.p.y;
    if (rates) at[2 * n] = C.v.x, at[3 * n] = C.v.y, at[4 * n] = C.a.x, at[5 * n] = C.a.y;
}

/* Runs `point` over all designs and steps; RATES is a constant in each of the two, so that nothing is asked inside. */
#define SWEEP_OF(point, RATES)                                                                                   \
    for (long first = 0; first < n; first += CHUNK)                                                              \
        for (long step = 0; step < steps; step++) {                                                              \
            const double co = cs[2 * step], si = cs[2 * step + 1];                                               \
            const long many = MIN(CHUNK, n - first);                                                             \
            const double *restrict of = d + first;                                                               \
            double *restrict to = out + step * (RATES ? 6 : 2) * n + first;                                      \
            _Pragma("GCC ivdep") for (long i = 0; i < many; i++)                                                 \
                put(to + i, n, point(of + i, n, co, si, w, e, RATES), RATES);                                    \
        }

#define SWEEP(name, point)                                                                                       \
    void name(long n, long steps, const double *d, const double *cs, double w, double e, int rates, double *out) \
    {                                                                                                            \
        if (rates) { SWEEP_OF(point, 1) } else { SWEEP_OF(point, 0) }                                            \
    }

/* Cosines and sines of angles evenly apart: those of every so manieth by the library, turned on to the next ones. */
#define ON 24
#define MOST 4096
static void circle(long steps, double first, double apart, double *restrict co, double *restrict si) {
    double c[ON], s[ON];
    for (int j = 0; j < ON; j++) c[j] = cos(j * apart), s[j] = sin(j * apart);
    for (long at = 0; at < steps; at += ON) {
        const double C = cos(first + at * apart), S = sin(first + at * apart);
        const long many = MIN(ON, steps - at);
        for (long j = 0; j < many; j++) co[at + j] = C * c[j] - S * s[j], si[at + j] = S * c[j] + C * s[j];
    }
}

/* The same over the steps of one design, at most MOST of them. */
#define TURN_OF(point, RATES)                                                                                    \
    _Pragma("GCC ivdep") for (long i = 0; i < steps; i++)                                                        \
        put(out + i, steps, point(d, 1, co[i], si[i], w, e, RATES), RATES);

#define TURN(name, point)                                                                                        \
    void name(long steps, const double *restrict d, double first, double apart, double w, double e, int rates,  \
              double *restrict out)                                                                              \
    {                                                                                                            \
        double co[MOST], si[MOST];                                                                               \
        circle(steps, first, apart, co, si);                                                                     \
        if (rates) { TURN_OF(point, 1) } else { TURN_OF(point, 0) }                                              \
    }

static const moving O = {{0, 0}, {0, 0}, {0, 0}};

/* Crank a, coupler b, rocker c, frame g along the x-axis: the pin C. */
INLINE moving rocker_pin(const double *d, long n, double c, double s, double w, double e, int rates) {
    moving D = O;
    D.p.x = d[3 * n];
    return dyad(crank(d[0], c, s, w, e), D, d[n] * d[n], d[2 * n] * d[2 * n], rates);
}

/* The same, F on the rocker, f from D at 0.4 rad from DC, and the dyad FG, GH with H on the frame: the pin G. */
INLINE moving second_pin(const double *d, long n, double c, double s, double w, double e, int rates) {
    moving D = O, F, H = O, C;
    D.p.x = d[3 * n], H.p = (two){d[7 * n], d[8 * n]};
    C = dyad(crank(d[0], c, s, w, e), D, d[n] * d[n], d[2 * n] * d[2 * n], rates);
    double part = d[4 * n] / d[2 * n], co = part * 0.92106099400288508280, si = part * 0.38941834230865049167;
    C.p.x -= D.p.x;
    F.p = (two){D.p.x + co * C.p.x - si * C.p.y, si * C.p.x + co * C.p.y};
    F.v = (two){co * C.v.x - si * C.v.y, si * C.v.x + co * C.v.y};
    F.a = (two){co * C.a.x - si * C.a.y, si * C.a.x + co * C.a.y};
    return dyad(F, H, d[5 * n] * d[5 * n], d[6 * n] * d[6 * n], rates);
}

/* Crank r about O, a lever about Q = (0, q) through its pin, on which E is at l from Q: the point E. */
INLINE moving lever_end(const double *d, long n, double c, double s, double w, double e, int rates) {
    double q = d[n], l = d[2 * n];
    moving A = crank(d[0], c, s, w, e);
    two x = {A.p.x, A.p.y - q};
    double inverse = 1.0 / sqrt(dot(x, x));
    two u = {x.x * inverse, x.y * inverse}, left = {-u.y, u.x};
    moving E = {{l * u.x, q + l * u.y}, {0, 0}, {0, 0}};
    if (!rates) return E;
    double turn = dot(left, A.v) * inverse, grow = (dot(left, A.a) - 2.0 * dot(u, A.v) * turn) * inverse;
    E.v = (two){l * turn * left.x, l * turn * left.y};
    E.a = (two){l * (grow * left.x - turn * turn * u.x), l * (grow * left.y - turn * turn * u.y)};
    return E;
}

SWEEP(four_bar, rocker_pin)

/* Four-bars that may stop: NaN from where the crank cannot go on, which may lie between two steps. The diagonal from B
 * to D is longest where the crank points away from D, and shortest where it points to it; the crank starts before the
 * first of these and goes one turn on. */
#define STOPPING_OF(RATES)                                                                                           \
    for (long first = 0; first < n; first += CHUNK) {                                                                \
        const long many = MIN(CHUNK, n - first);                                                                     \
        const double *restrict of = d + first;                                                                       \
        double least[CHUNK], most[CHUNK];                                                                            \
        for (long i = 0; i < many; i++) {                                                                            \
            const double a = of[i], b = of[n + i], c = of[2 * n + i], g = of[3 * n + i];                             \
            const double begin = a * a + g * g - 2.0 * a * g * cs[0];                                                \
            least[i] = (b - c) * (b - c), most[i] = (b + c) * (b + c);                                               \
            if (!(begin >= least[i] && begin <= most[i])) most[i] = -1.0;                                            \
        }                                                                                                            \
        int away = 0, towards = 0;                                                                                   \
        for (long step = 0; step < steps; step++) {                                                                  \
            const double co = cs[2 * step], si = cs[2 * step + 1];                                                   \
            if (!away && si < 0.0) {                                                                                 \
                away = 1;                                                                                            \
                for (long i = 0; i < many; i++)                                                                      \
                    if ((of[i] + of[3 * n + i]) * (of[i] + of[3 * n + i]) > most[i]) most[i] = -1.0;                 \
            }                                                                                                        \
            if (away && !towards && si >= 0.0) {                                                                     \
                towards = 1;                                                                                         \
                for (long i = 0; i < many; i++)                                                                      \
                    if ((of[i] - of[3 * n + i]) * (of[i] - of[3 * n + i]) < least[i]) most[i] = -1.0;                \
            }                                                                                                        \
            double *restrict to = out + step * (RATES ? 6 : 2) * n + first;                                          \
            _Pragma("GCC ivdep") for (long i = 0; i < many; i++) {                                                   \
                const double a = of[i], g = of[3 * n + i], far = a * a + g * g - 2.0 * a * g * co;                   \
                moving C = rocker_pin(of + i, n, co, si, w, e, RATES);                                               \
                const double gone = far >= least[i] && far <= most[i] ? 0.0 : NAN;                                   \
                C.p.x += gone, C.p.y += gone;                                                                        \
                if (RATES) C.v.x += gone, C.v.y += gone, C.a.x += gone, C.a.y += gone;                               \
                put(to + i, n, C, RATES);                                                                            \
            }                                                                                                        \
        }                                                                                                            \
    }

void four_bar_stopping(long n, long steps, const double *d, const double *cs, double w, double e, int rates,
                       double *out)
{
    if (rates) { STOPPING_OF(1) } else { STOPPING_OF(0) }
}
TURN(four_bar_turn, rocker_pin)
SWEEP(watt, second_pin)
SWEEP(quick_return, lever_end)

/* A row of four-bars, each driven by the rocker before, whose unit vector is left in co, si. */
void row(long cells, long steps, const double *restrict d, double first, double apart, double *restrict out) {
    double at = 0.0, co[MOST], si[MOST];
    circle(steps, first, apart, co, si);
    for (long k = 0; k < cells; k++, d += 4) {
        const double a = d[0], b2 = d[1] * d[1], c = d[2], g = d[3];
        moving D = O;
        D.p.x = g;
        for (long i = 0; i < steps; i++) {
            two C = dyad(crank(a, co[i], si[i], 0.0, 0.0), D, b2, c * c, 0).p;
            co[i] = (C.x - g) / c, si[i] = C.y / c;
            out[i] = at + C.x, out[steps + i] = C.y;
        }
        at += g;
    }
}

/* Newton's iteration for a six-bar whose two loops do not split: four angles at once, carried as unit vectors.
 *
 * Loop 1: a e1 + b e2 - c e3 = D; loop 2: a e1 + E in e2's axes - l e4 = F, the crank's pin at r about G. Each step
 * starts from the polynomial through the last six. The two couplings c e3 and l e4 leave by a product with e3 and e4
 * (a rotation moves them across themselves), which leaves two equations for the turns of e1 and e2.
 */
#define ORDER 6
#define LANES 16 /* designs at a time; what they give stands together, block after block */
static const double THROUGH[ORDER + 1][ORDER] = {
    {0}, {1}, {2, -1}, {3, -3, 1}, {4, -6, 4, -1}, {5, -10, 10, -5, 1}, {6, -15, 20, -15, 6, -1}};

INLINE two unit(two e) { /* half a Newton step on its length */
    double by = 1.5 - 0.5 * dot(e, e);
    return (two){e.x * by, e.y * by};
}

INLINE two turned(two e, double by) { return (two){e.x - by * e.y, e.y + by * e.x}; }

/* The turns of the four vectors that move loop 1 by -f and loop 2 by -g. */
#define SOLVE(f, g)                                                                              \
    p = dot(f, e3), q = dot(g, e4);                                                              \
    t1 = (q * m12 - p * m22) * whole, t2 = (p * m21 - q * m11) * whole;                          \
    t3 = (dot(f, n3) + t1 * dot(v1, n3) + t2 * dot(v2, n3)) / c;                                 \
    t4 = (dot(g, n4) + t1 * dot(v1, n4) + t2 * dot(v4, n4)) / l;

#define SET                                                                                      \
    two n3 = {-e3.y, e3.x}, n4 = {-e4.y, e4.x}, v1 = {-a * e1.y, a * e1.x};                      \
    two v2 = {-b * e2.y, b * e2.x}, E = {ex * e2.x - ey * e2.y, ex * e2.y + ey * e2.x};          \
    two v4 = {-E.y, E.x};                                                                        \
    double m11 = dot(v1, e3), m12 = dot(v2, e3), m21 = dot(v1, e4), m22 = dot(v4, e4);           \
    double whole = 1.0 / (m11 * m22 - m12 * m21), p, q, t1, t2, t3, t4;

INLINE void march(const int W, long n, long steps, const double *restrict d, const double *restrict cs, double w,
                  double e, const int rates, const double *start, double *restrict out) {
    double z[ORDER][8][LANES] __attribute__((aligned(64)));
    double y[8][LANES] __attribute__((aligned(64)));
    double d_[11][LANES] __attribute__((aligned(64)));
    for (int k = 0; k < 11; k++) for (int i = 0; i < W; i++) d_[k][i] = d[k * n + i];
    for (int k = 0; k < 8; k++) for (int i = 0; i < W; i++) y[k][i] = start[k];
    for (long step = 0; step < steps; step++) {
        const double co = cs[2 * step], si = cs[2 * step + 1];
        const int order = MIN(step, ORDER);
        const double *by = THROUGH[order];
        if (order == ORDER) {
            int at[ORDER];
            for (int j = 0; j < ORDER; j++) at[j] = (step - 1 - j) % ORDER;
            for (int k = 0; k < 8; k++) for (int i = 0; i < W; i++) {
                double sum = 0.0;
                for (int j = 0; j < ORDER; j++) sum += by[j] * z[at[j]][k][i];
                y[k][i] = sum;
            }
        } else if (order)
            for (int k = 0; k < 8; k++) for (int i = 0; i < W; i++) {
                double sum = 0.0;
                for (int j = 0; j < order; j++) sum += by[j] * z[(step - 1 - j) % ORDER][k][i];
                y[k][i] = sum;
            }
        double most = 1.0;
        for (int times = 0; times < 20 && !(most < 1e-8); times++) {
            double far[LANES];
            for (int i = 0; i < W; i++) {
                const double a = d_[0][i], b = d_[1][i], c = d_[2][i], g = d_[3][i], ex = d_[4][i], ey = d_[5][i];
                const double l = d_[6][i], r = d_[7][i];
                two e1 = unit((two){y[0][i], y[1][i]}), e2 = unit((two){y[2][i], y[3][i]});
                two e3 = unit((two){y[4][i], y[5][i]}), e4 = unit((two){y[6][i], y[7][i]});
                SET
                two f = {a * e1.x + b * e2.x - c * e3.x - g, a * e1.y + b * e2.y - c * e3.y};
                two h = {a * e1.x + E.x - l * e4.x - d_[8][i] - r * co, a * e1.y + E.y - l * e4.y - d_[9][i] - r * si};
                SOLVE(f, h)
                e1 = turned(e1, t1), e2 = turned(e2, t2), e3 = turned(e3, t3), e4 = turned(e4, t4);
                y[0][i] = e1.x, y[1][i] = e1.y, y[2][i] = e2.x, y[3][i] = e2.y;
                y[4][i] = e3.x, y[5][i] = e3.y, y[6][i] = e4.x, y[7][i] = e4.y;
                far[i] = fabs(t1) + fabs(t2) + fabs(t3) + fabs(t4);
            }
            most = 0.0;
            for (int i = 0; i < W; i++) most = far[i] > most ? far[i] : most;
        }
        memcpy(z[step % ORDER], y, sizeof y);
        double *to = out + step * (rates ? 6 : 2) * W;
        for (int i = 0; i < W; i++) {
            const double a = d_[0][i], b = d_[1][i], c = d_[2][i], ex = d_[4][i], ey = d_[5][i], l = d_[6][i];
            const double r = d_[7][i];
            two e1 = {y[0][i], y[1][i]}, e2 = {y[2][i], y[3][i]}, e3 = {y[4][i], y[5][i]}, e4 = {y[6][i], y[7][i]};
            SET
            moving P = {{a * e1.x + E.x, a * e1.y + E.y}, {0, 0}, {0, 0}};
            if (rates) {
                moving F = crank(r, co, si, w, e);
                two none = {0, 0}, h = {-F.v.x, -F.v.y};
                SOLVE(none, h)
                P.v = (two){t1 * v1.x + t2 * v4.x, t1 * v1.y + t2 * v4.y};
                /* what the rates of the unit vectors pull towards their centres */
                double w1 = a * t1 * t1, w2 = t2 * t2, w3 = c * t3 * t3, w4 = l * t4 * t4;
                two in = {-w1 * e1.x - w2 * b * e2.x + w3 * e3.x, -w1 * e1.y - w2 * b * e2.y + w3 * e3.y};
                two to_e = {-w1 * e1.x - w2 * E.x, -w1 * e1.y - w2 * E.y};
                h = (two){to_e.x + w4 * e4.x - F.a.x, to_e.y + w4 * e4.y - F.a.y};
                SOLVE(in, h)
                P.a = (two){to_e.x + t1 * v1.x + t2 * v4.x, to_e.y + t1 * v1.y + t2 * v4.y};
            }
            put(to + i, W, P, rates);
        }
    }
}

#define MARCH(W)                                                                                                   \
    if (rates) march(W, n, steps, d + at, cs, w, e, 1, start, out + at * steps * 6);                               \
    else march(W, n, steps, d + at, cs, w, e, 0, start, out + at * steps * 2);

void stephenson(long n, long steps, const double *d, const double *cs, double w, double e, int rates, double *out,
                const double *start) {
    long at = 0;
    for (; at + LANES <= n; at += LANES) { MARCH(LANES) }
    for (; at < n; at++) { MARCH(1) }
}

/* Linkages of any dyads, as data: joint j of linkage i is on the frame (kind 0, at size[0], size[1]), on the crank (1, at
 * radius size[0] about joint of[0], in the direction size[1], size[2] where the crank starts), joins two joints (2, of[0]
 * and of[1] at the squared distances size[0], size[1], on the side size[2]), or stands on a link with two others (3, from
 * of[0] by size[0] of the way to of[1], and by size[1] of it to the left). Joints follow those that they need.
 * cs: of how far the crank has turned. Row r of joint j at a step is out[(j * rows + r) * steps + step].
 */
INLINE moving get(const double *restrict at, long n, int rates) {
    moving P = {{at[0], at[n]}, {0, 0}, {0, 0}};
    if (rates) P.v = (two){at[2 * n], at[3 * n]}, P.a = (two){at[4 * n], at[5 * n]};
    return P;
}

INLINE void joints(long n, long steps, const long *restrict kind, const long *restrict of, const double *restrict size,
                   const double *restrict co, const double *restrict si, double w, double e, const int rates,
                   double *restrict out) {
    const long rows = (rates ? 6 : 2) * steps;
    for (long j = 0; j < n; j++, size += 3) {
        double *restrict to = out + j * rows;
        const double *p = out + of[2 * j] * rows, *q = out + of[2 * j + 1] * rows;
        const double a = size[0], b = size[1], c = size[2];
        if (kind[j] == 0) {
            moving P = {{a, b}, {0, 0}, {0, 0}};
            for (long i = 0; i < steps; i++) put(to + i, steps, P, rates);
        } else if (kind[j] == 1) {
            _Pragma("GCC ivdep") for (long i = 0; i < steps; i++) {
                moving P = crank(a, b * co[i] - c * si[i], c * co[i] + b * si[i], w, e);
                P.p.x += p[i], P.p.y += p[steps + i];
                put(to + i, steps, P, rates);
            }
        } else if (kind[j] == 3) {
            for (long k = 0; k < (rates ? 6 : 2); k += 2, to += 2 * steps, p += 2 * steps, q += 2 * steps)
                _Pragma("GCC ivdep") for (long i = 0; i < steps; i++) {
                    const double x = q[i] - p[i], y = q[steps + i] - p[steps + i];
                    to[i] = p[i] + a * x - b * y, to[steps + i] = p[steps + i] + a * y + b * x;
                }
        } else {
            _Pragma("GCC ivdep") for (long i = 0; i < steps; i++)
                put(to + i, steps, joined(get(p + i, steps, rates), get(q + i, steps, rates), a, b, c, rates), rates);
        }
    }
}

void tape(long n, long steps, const long *first, const long *kind, const long *of, const double *size, const double *cs,
          double w, double e, int rates, double *out) {
    double co[MOST], si[MOST];
    for (long i = 0; i < steps; i++) co[i] = cs[2 * i], si[i] = cs[2 * i + 1];
    for (long k = 0; k < n; k++) {
        const long at = first[k], many = first[k + 1] - at;
        if (rates) joints(many, steps, kind + at, of + 2 * at, size + 3 * at, co, si, w, e, 1, out + at * 6 * steps);
        else joints(many, steps, kind + at, of + 2 * at, size + 3 * at, co, si, w, e, 0, out + at * 2 * steps);
    }
}
