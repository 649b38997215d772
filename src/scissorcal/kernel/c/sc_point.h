/* The point of a mechanism that touches a surface: how it moves, and how heavy it is. */
#ifndef SC_POINT_H
#define SC_POINT_H

enum { SC_POINT_AXES = 3 };

typedef struct {
    int axes;
    float inverse[SC_POINT_AXES][SC_POINT_AXES]; /* of the Jacobian */
    float press[SC_POINT_AXES];   /* effort that presses by a newton: -J^T n */
    float yields[SC_POINT_AXES];  /* acceleration of the point by a newton from the surface */
    float mobility;               /* its part along the normal: 1 / mass [1/kg] */
} sc_point;

/* Find it from the Jacobian (row of a coordinate, column of an axis), the inertia and the unit
 * normal, with the first `axes` places, 2 or 3. Returns 0 where the Jacobian's columns, at unit
 * length, span less than least_volume, or the inertia is not positive definite. */
int sc_point_find(sc_point *point, int axes, const float jacobian[SC_POINT_AXES][SC_POINT_AXES],
                  const float inertia[SC_POINT_AXES][SC_POINT_AXES], const float *normal,
                  float least_volume);

float sc_point_dot(int axes, const float *a, const float *b);

/* Of a matrix of rows of SC_POINT_AXES, given by its first element. */
void sc_point_times(int axes, const float *matrix, const float *vector, float *product);

#endif
