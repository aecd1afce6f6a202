// Small pieces from which the built-in scenes are generated. Positions in metres, +Y up, counter-clockwise from the
// front. Nothing here reads files or draws random numbers: the same call gives the same bytes.
#pragma once

#include <functional>
#include <glm/glm.hpp>
#include <numbers>
#include <string>

#include "server/scene/asset.h"

namespace gonio {

inline constexpr double kTau = 2.0 * std::numbers::pi;

// A flat quadrilateral a, b, c, d (counter-clockwise from the front); uv runs 0..uv_size from a to c.
void add_quad(Mesh& mesh, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, const glm::dvec3& d,
              const glm::dvec2& uv_size = glm::dvec2(1.0));

// The outside of an axis-aligned box. Faces are left out by their bit: 1 bottom, 2 top, 4 -X, 8 +X, 16 -Z, 32 +Z.
inline constexpr unsigned kNoBottom = 1, kNoTop = 2, kNoLeft = 4, kNoRight = 8, kNoBack = 16, kNoFront = 32;
// uv_per_m: texture repeats per metre.
void add_box(Mesh& mesh, const glm::dvec3& min, const glm::dvec3& max, unsigned left_out = 0, double uv_per_m = 1.0);

// A point of a parametric surface; du x dv points to the front.
using Surface = std::function<glm::dvec3(double u, double v)>;
// Adds (nu x nv) cells over [0, 1]^2 with smooth normals from central differences of the surface itself. With closed_u
// / closed_v the surface is periodic there, so differences wrap around instead of stopping at the rim. The texture
// coordinates at (1, 1) are uv_size. Cells that shrink to a line lose their degenerate triangle.
void add_surface(Mesh& mesh, const Surface& surface, int nu, int nv, bool closed_u, bool closed_v,
                 const glm::dvec2& uv_size = glm::dvec2(1.0));

// A solid of revolution about +Y: profile (radius, height) pairs from bottom to top, `slices` around. Profile corners
// stay sharp (flat normals along the profile, smooth around). uv: around uv_size.x times, uv_size.y per metre upwards.
void add_lathe(Mesh& mesh, const std::vector<glm::dvec2>& profile, int slices,
               const glm::dvec2& uv_size = glm::dvec2(1.0));

// Sets mesh.bounds from its vertices.
void measure(Mesh& mesh);
// Sets scene.bounds from the vertices of every instance; where there is none as measure_lights() does.
void measure(SceneAsset& scene);
// Sets scene.bounds 1 m around its lights; without any 1 m around the origin.
void measure_lights(SceneAsset& scene);

// Appends. Result: the index.
int add_material(SceneAsset& scene, std::string name, const glm::vec3& reflectance, int image = -1);
int add_mesh(SceneAsset& scene, Mesh mesh, int material);
void add_instance(SceneAsset& scene, int mesh, std::string node, const glm::dmat4& world_from_mesh = glm::dmat4(1.0));
// A batwing luminaire that looks straight down, C0 along +X.
void add_luminaire(SceneAsset& scene, const glm::dvec3& position, double multiplier = 1.0);

// Pictures for the surfaces, computed from closed formulas. All are square with side size_px, tile without a seam, and
// store albedo (0..1, linear) sRGB-encoded, alpha 255.
Image brick_texture(int size_px);    // 4 courses of running bond with mortar joints
Image marble_texture(int size_px);   // 2 x 2 floor slabs, light and dark, with veins
Image plaster_texture(int size_px);  // pale stone with soft mottling
Image cloth_texture(int size_px);    // a pale weave with stripes, to be tinted by the base colour

}  // namespace gonio
