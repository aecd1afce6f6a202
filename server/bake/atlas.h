// All sheets in one atlas, the texels that they cover, and the way back from a point of a surface to its texel. Any
// thread. No files.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <stop_token>
#include <vector>

#include "ies/core/result.h"
#include "server/bake/sheet.h"

namespace gonio::bake {

inline constexpr int kMostSide = 8192;  // texels: of an atlas
inline constexpr int kGutter = 2;       // texels around each sheet: what bilinear filtering and one more step read

// What is baked at a texel.
struct Texel {
    int pixel = 0;              // of the atlas, row by row from the top
    int sheet = 0;              // index into Atlas::places
    glm::vec3 position{0.0f};   // sample point, local, m
    glm::vec3 normal{0.0f};     // unit: cosines are taken with it
    glm::vec3 geometric{0.0f};  // unit: light from behind it is stopped
    glm::vec3 albedo{0.0f};     // mean over its surface
    glm::vec3 emission{0.0f};   // likewise, cd/m²
    float area_m2 = 0.0f;       // of surface in its square: its weight in means
    bool valid = false;         // else it lies inside something, or shows a hole: filled from its neighbours
};

// A side of a triangle in the atlas.
struct PlacedSide {
    Side side;
    int sheet = 0;
    glm::dvec2 corner[3];         // texels of the atlas, of the mesh's corners 0, 1, 2
    std::vector<Polygon> pieces;  // texels of the atlas; empty: all of it
};

// Where a sheet lies, its gutter included.
struct Place {
    glm::ivec2 low{0}, high{0};  // pixels: first, and one beyond the last
};

// Two places of the atlas, texels, that show the same stretch of a surface: from and to on each.
struct Seam {
    glm::dvec2 from[2], to[2];
    int sheet[2] = {0, 0};
};

struct AtlasSettings {
    int width = 1024, height = 1024;  // texels, at most kMostSide
    double texel_m = 0.0;             // side of a texel; 0: as fine as the atlas can hold
    bool second_uv = false;           // the file's TEXCOORD_1 instead of charts of its own
    int threads = 0;
};

struct Atlas {
    int width = 0, height = 0;
    double texels_per_m = 0.0;  // 0: as the file's texture coordinates have it
    std::vector<PlacedSide> sides;
    std::vector<Place> places;
    std::vector<Texel> texels;
    std::vector<std::int32_t> texel_at;  // of each pixel: index into texels, -1: none
    std::vector<Seam> seams;
    std::vector<std::int32_t> first_side;  // of an instance: index into side_list, twice its triangles and one more
    std::vector<std::int32_t> side_start, side_list;
    // Of a side that was not cut, by the same index: where its corners 0, 1 and 2 lie. A bounce reads it for each ray.
    struct Way {
        glm::vec2 corner{0.0f}, to_second{0.0f}, to_third{0.0f};
        bool whole = false;
    };
    std::vector<Way> ways;

    // Result: index of the texel that shows this point of a triangle, -1: none. u, v: barycentric, as of a hit.
    int texel_of(int instance, int triangle, bool back, float u, float v) const;
    // Fills side_start, side_list and ways from sides.
    void index_sides(const SceneAsset& asset);
    // The same as texel_of, of sides that walls cut and of points on edges too. slot: index into side_start.
    int search_texel(std::size_t slot, float u, float v) const;
};

// Result: the atlas of a scene's surfaces. Errors, "bake.size": "too_small" where charts and gutters do not fit,
// "invalid_argument". Of second_uv: "no_second_uv", "overlapping_uv" with the two triangles.
Result<Atlas> make_atlas(const trace::Geometry& geometry, const AtlasSettings& settings,
                         const std::stop_token& stop = {});

// Parts of make_atlas.
// Puts a sheet's texels and sides into the atlas, its corner at `at`.
void place_sheet(Atlas& atlas, const trace::Geometry& geometry, const Sheet& sheet, const glm::ivec2& at);
// Sets a texel at a sample point: position, normals, albedo and emission, these as their mean over the points around.
void fill_texel(Texel& texel, const trace::Geometry& geometry, const Side& side, float u, float v,
                const std::vector<glm::vec2>& around);
// Result: seams along the edges that sides of different sheets share, where their normals agree and light passes.
void find_seams(Atlas& atlas, const trace::Geometry& geometry);
// Result: whether a point a little above one texel sees one above the other.
bool sees(const trace::Geometry& geometry, const Texel& a, const Texel& b, float above_m);

Result<Atlas> second_uv_atlas(const trace::Geometry& geometry, const AtlasSettings& settings);

}  // namespace gonio::bake
