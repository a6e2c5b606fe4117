/* The measure for ARX estimation: passes over the data in C. gcc -O3 -march=native -ffast-math */
#include <stddef.h>

double read_pass(const double *y, const double *u, size_t n)
{
    double total = 0.0;
    for (size_t i = 0; i < n; i++)
        total += y[i] + u[i];
    return total;
}

/* Covariance of y(t), y(t-1..3), u(t-3), u(t-4): 6 x 6, upper triangle, row by row. */
void covariance_pass(const double *y, const double *u, size_t n, double *out)
{
    double c[21] = {0};
    for (size_t t = 4; t < n; t++) {
        const double z[6] = {y[t], y[t - 1], y[t - 2], y[t - 3], u[t - 3], u[t - 4]};
        size_t at = 0;
#pragma GCC unroll 6
        for (int i = 0; i < 6; i++)
#pragma GCC unroll 6
            for (int j = i; j < 6; j++)
                c[at++] += z[i] * z[j];
    }
    for (int k = 0; k < 21; k++)
        out[k] = c[k];
}
