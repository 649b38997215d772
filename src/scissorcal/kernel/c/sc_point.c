#include "sc_point.h"

#include <math.h>

enum { MOST = SC_POINT_AXES };

static const float LEAST_INERTIA_VOLUME = 1e-4f; /* beyond it float32 leaves no digits to invert */

float sc_point_dot(int axes, const float *a, const float *b)
{
    float sum = 0.0f;
    for (int i = 0; i < axes; i++) {
        sum += a[i] * b[i];
    }
    return sum;
}

void sc_point_times(int axes, const float *matrix, const float *vector, float *product)
{
    for (int i = 0; i < axes; i++) {
        product[i] = sc_point_dot(axes, matrix + MOST * i, vector);
    }
}

/* Invert by cofactors; the matrix is complete: of 2 axes it ends with a row and column of the unit
 * matrix. Returns the determinant, or 0 if its size is not at least `least`. */
static float invert(float matrix[MOST][MOST], float least, float inverse[MOST][MOST])
{
    for (int i = 0; i < MOST; i++) {
        const int up = (i + 1) % MOST, down = (i + 2) % MOST;
        for (int j = 0; j < MOST; j++) {
            const int right = (j + 1) % MOST, left = (j + 2) % MOST;
            inverse[j][i] =
                matrix[up][right] * matrix[down][left] - matrix[up][left] * matrix[down][right];
        }
    }
    const float determinant = matrix[0][0] * inverse[0][0] + matrix[0][1] * inverse[1][0] +
                              matrix[0][2] * inverse[2][0];
    if (!(fabsf(determinant) >= least)) {
        return 0.0f;
    }
    for (int j = 0; j < MOST; j++) {
        for (int i = 0; i < MOST; i++) {
            inverse[j][i] /= determinant;
        }
    }
    return determinant;
}

/* Axes may turn or slide: only the angles between the Jacobian's columns say how singular it is. */
static int invert_jacobian(sc_point *point, const float jacobian[MOST][MOST], float least_volume)
{
    float unit[MOST][MOST] = {{1.0f, 0.0f, 0.0f}, {0.0f, 1.0f, 0.0f}, {0.0f, 0.0f, 1.0f}};
    float length[MOST] = {1.0f, 1.0f, 1.0f};
    for (int j = 0; j < point->axes; j++) {
        float square = 0.0f;
        for (int i = 0; i < point->axes; i++) {
            square += jacobian[i][j] * jacobian[i][j];
        }
        length[j] = sqrtf(square);
        if (!(length[j] > 0.0f)) {
            return 0;
        }
        for (int i = 0; i < point->axes; i++) {
            unit[i][j] = jacobian[i][j] / length[j];
        }
    }
    if (invert(unit, least_volume, point->inverse) == 0.0f) {
        return 0;
    }
    for (int j = 0; j < MOST; j++) {
        for (int i = 0; i < MOST; i++) {
            point->inverse[j][i] /= length[j];
        }
    }
    return 1;
}

/* Rates that a newton from the surface gives to the axes in a second: D^-1 J^T n. Rows and columns
 * are scaled by the diagonal's roots, so that units do not matter. */
static int push_axes(const sc_point *point, const float inertia[MOST][MOST], float *pushed)
{
    float scaled[MOST][MOST] = {{1.0f, 0.0f, 0.0f}, {0.0f, 1.0f, 0.0f}, {0.0f, 0.0f, 1.0f}};
    float inverse[MOST][MOST], root[MOST] = {1.0f, 1.0f, 1.0f}, effort[MOST] = {0.0f};
    for (int i = 0; i < point->axes; i++) {
        if (!(inertia[i][i] > 0.0f)) {
            return 0;
        }
        root[i] = sqrtf(inertia[i][i]);
        effort[i] = -point->press[i] / root[i];
    }
    for (int i = 0; i < point->axes; i++) {
        for (int j = 0; j < point->axes; j++) {
            scaled[i][j] = inertia[i][j] / (root[i] * root[j]);
        }
    }
    if (!(invert(scaled, LEAST_INERTIA_VOLUME, inverse) > 0.0f)) {
        return 0;
    }
    sc_point_times(point->axes, &inverse[0][0], effort, pushed);
    for (int i = 0; i < point->axes; i++) {
        pushed[i] /= root[i];
    }
    return 1;
}

int sc_point_find(sc_point *point, int axes, const float jacobian[MOST][MOST],
                  const float inertia[MOST][MOST], const float *normal, float least_volume)
{
    float pushed[MOST];
    point->axes = axes;
    if (!invert_jacobian(point, jacobian, least_volume)) {
        return 0;
    }
    for (int j = 0; j < axes; j++) {
        point->press[j] = 0.0f;
        for (int i = 0; i < axes; i++) {
            point->press[j] -= jacobian[i][j] * normal[i];
        }
    }
    if (!push_axes(point, inertia, pushed)) {
        return 0;
    }
    sc_point_times(axes, &jacobian[0][0], pushed, point->yields);
    point->mobility = sc_point_dot(axes, normal, point->yields);
    return point->mobility > 0.0f;
}
