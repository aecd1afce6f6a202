// Closed forms that the renderer is measured against. Nothing here knows the renderer: lengths in m, angles in radians,
// light in cd, lx and lm, heights along +z as in CIE 171:2006.
#pragma once

namespace gonio::accuracy {

// Configuration factors from a differential element to a rectangle: the share of the element's cosine-weighted
// hemisphere that the rectangle fills, 0..1. The element lies at the origin. Sources: CIE 171:2006 section 5;
// Howell's catalogue of configuration factors, B-3 and B-4.

// The element faces a parallel rectangle x0..x1 by y0..y1 at distance c > 0.
double parallel_factor(double x0, double x1, double y0, double y1, double c);
// The element's normal is +z; the rectangle stands on its plane's side z >= 0, perpendicular to that plane at distance
// c > 0: x0..x1 along the common direction, z0..z1 above the element's plane (0 <= z0 <= z1).
double perpendicular_factor(double x0, double x1, double z0, double z1, double c);

// Result: solid angle of a rectangle a x b seen from distance c on the axis through its middle, sr.
double rectangle_solid_angle(double a, double b, double c);

// CIE 171 case 5.3, illuminance in lx: a Lambertian panel of 1 m x 1 m and luminance_nit in the middle of the ceiling
// of a black room 4 m x 4 m x 3 m. On the wall y = 0 at (2, z), and on the floor at (2, y).
double area_source_on_wall(double luminance_nit, double z);
double area_source_on_floor(double luminance_nit, double y);

// CIE 171 case 5.6, E / (E_hz rho): the horizontal surface z = 0 of side x side around (2, 2), evenly lit, seen from
// the wall y = 0 at (2, z) and from the ceiling z = 3 at (2, y). What lies beyond the wall (y < 0) is below the wall
// element's plane; the ceiling element sees all of the surface.
double reflection_on_wall(double side, double z);
double reflection_on_ceiling(double side, double y);

// CIE 171 case 5.7, E / (E_v rho): the wall y = 4 (4 m x 3 m), evenly lit, seen past a black box 1 m high and as wide
// as the room at y = 2.5..2.7, from the wall y = 0 at (2, z) and from the floor at (2, y), y < 2.5.
double obstructed_on_wall(double z);
double obstructed_on_floor(double y);
// The same with the box removed.
double unobstructed_on_wall(double z);
double unobstructed_on_floor(double y);

// CIE 171 case 5.8: mean illuminance after at least one reflection over all surfaces of a closed room of uniform
// reflectance, by the balance of energy: flux rho / (area (1 - rho)).
double mean_indirect(double flux_lm, double area_m2, double rho);

// A Lambertian disc of radius r on the axis at distance d, facing: pi L r² / (r² + d²).
double disc_on_axis(double luminance_nit, double r, double d);

}  // namespace gonio::accuracy
