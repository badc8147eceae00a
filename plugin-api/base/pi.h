/* The circle's constant, which the standard library of C does not name. */
#ifndef BASE_PI_H
#define BASE_PI_H

#define BASE_PI 3.14159265358979323846

#endif
