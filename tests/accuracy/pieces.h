// What the cases are built from: CIE coordinates, walls, rooms, luminaires of a given law, quadrature.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "tests/accuracy/cases.h"
#include "tests/scenes/scenes.h"

namespace gonio::accuracy {

// CIE 171 has z up; the world here has +Y up. A turn by -90 degrees about x, so that handedness stays.
inline glm::dvec3 cie(double x, double y, double z) {
    return {x, z, -y};
}

// A quadrilateral in world coordinates, counter-clockwise from the front.
test::Piece wall(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, const glm::dvec3& d, float reflectance);
// The inside of a box 0..x, 0..y, 0..z in CIE coordinates: floor, ceiling, y = 0, y = max, x = 0, x = max.
std::vector<test::Piece> room(double x, double y, double z, float reflectance);
// The outside of a box between two corners in CIE coordinates.
std::vector<test::Piece> block(const glm::dvec3& low, const glm::dvec3& high, float reflectance);

// A profile of rotational symmetry from I(theta) in cd; step in degrees, at most 1.
std::shared_ptr<const Profile> axial_profile(const std::string& name, double step_deg,
                                             const std::function<double(double theta)>& law);
// Lights a plane at distance h evenly with E lux: I = E h² / cos³, dark from `edge_rad` on.
std::shared_ptr<const Profile> even_light(double lux, double h, double edge_rad);
// The profile with a luminous opening.
std::shared_ptr<const Profile> with_opening(const Profile& profile, const ies::Opening& opening);

// Result: a scene without luminaires, lit by emissive surfaces alone.
Scene unlit_scene(std::vector<test::Piece> pieces);

// Gauss-Legendre points over the parallelogram corner + s·u + t·v, n by n (n >= 2), weights adding up to
// `total`; exact for polynomials of degree 2n - 1 along each side.
std::vector<Sample> quadrature(const glm::dvec3& corner, const glm::dvec3& u, const glm::dvec3& v,
                               const glm::dvec3& normal, int n, double total);

struct Face {
    const char* name;
    glm::dvec3 corner, u, v, normal;  // world
    double area() const { return glm::length(glm::cross(u, v)); }
};
// The six faces of room(), in its order.
std::vector<Face> room_faces(double x, double y, double z);

}  // namespace gonio::accuracy
