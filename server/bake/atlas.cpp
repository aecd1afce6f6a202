#include "server/bake/atlas.h"

#include <algorithm>
#include <cmath>

#include "server/bake/packer.h"
#include "server/bake/split.h"
#include "server/bake/validity.h"
#include "server/trace/parallel.h"

namespace gonio::bake {
namespace {

constexpr double kShrink = 0.96;       // of the density, where charts do not fit
constexpr double kGood = 0.7;          // of the density that there would be without gutters
constexpr double kSmallTexels = 64.0;  // a chart of fewer is small
constexpr double kOnEdge = 1e-4;       // texels
constexpr int kAlbedoSide = 4;         // of the grid of points over a texel that its mean albedo is of

Error too_small(const AtlasSettings& settings, const std::string& why) {
    return {"too_small", "bake.size", std::to_string(settings.width) + "x" + std::to_string(settings.height), why};
}

std::vector<glm::ivec2> with_gutters(const std::vector<Sheet>& sheets) {
    std::vector<glm::ivec2> sizes;
    for (const Sheet& sheet : sheets) sizes.push_back(sheet.size + 2 * kGutter);
    return sizes;
}

glm::ivec2 size_at(const Chart& chart, double texels_per_m) {
    const glm::dvec2 size = glm::max(glm::dvec2(1.0), glm::ceil(chart.size_m * texels_per_m - 1e-6));
    return glm::ivec2(glm::min(size, glm::dvec2(1e6))) + 2 * kGutter;
}

bool fits(const std::vector<Chart>& charts, double texels_per_m, const glm::ivec2& room) {
    std::vector<glm::ivec2> sizes;
    double area = 0.0;
    for (const Chart& chart : charts) {
        sizes.push_back(size_at(chart, texels_per_m));
        area += static_cast<double>(sizes.back().x) * sizes.back().y;
    }
    return area <= static_cast<double>(room.x) * room.y && pack(sizes, room).has_value();
}

double area_of(const std::vector<Chart>& charts) {
    double area = 1e-12;
    for (const Chart& chart : charts) area += chart.size_m.x * chart.size_m.y;
    return area;
}

// Result: the most texels a metre at which all charts fit, or the one that was asked for; nothing where none does.
std::optional<double> finest_density(const std::vector<Chart>& charts, const AtlasSettings& settings) {
    const glm::ivec2 room(settings.width, settings.height);
    if (settings.texel_m > 0.0) {
        if (!fits(charts, 1.0 / settings.texel_m, room)) return std::nullopt;
        return 1.0 / settings.texel_m;
    }
    double longest = 0.0;
    for (const Chart& chart : charts) longest = std::max({longest, chart.size_m.x, chart.size_m.y});
    double density = std::sqrt(static_cast<double>(room.x) * room.y / area_of(charts));
    while (!fits(charts, density, room)) {
        if (density * longest < 1.0) return std::nullopt;  // coarser than one texel a chart there is nothing
        density *= kShrink;
    }
    return density;
}

bool has_detail(const trace::Geometry& geometry, const Side& side) {
    const SceneAsset& asset = geometry.asset();
    const Mesh& mesh =
        asset.meshes[static_cast<std::size_t>(asset.instances[static_cast<std::size_t>(side.instance)].mesh)];
    const Material& material = asset.materials[static_cast<std::size_t>(mesh.material)];
    return material.base_color_image >= 0 || material.emissive_image >= 0 || !mesh.colors.empty();
}

// Result: barycentric points of a texel's square that lie on the side.
std::vector<glm::vec2> points_around(const Sheet& sheet, const Covered& covered) {
    std::vector<glm::vec2> points;
    const auto& flat = sheet.flat[static_cast<std::size_t>(covered.side)];
    for (int j = 0; j < kAlbedoSide; ++j) {
        for (int i = 0; i < kAlbedoSide; ++i) {
            const glm::dvec2 p = glm::dvec2(covered.at) + (glm::dvec2(i, j) + 0.5) / static_cast<double>(kAlbedoSide);
            const glm::dvec2 w = barycentric(flat, p);
            const glm::dvec2 back = flat[0] + w.x * (flat[1] - flat[0]) + w.y * (flat[2] - flat[0]);
            if (glm::length(back - p) > 1e-6) continue;  // beside it
            const bool turned = sheet.sides[static_cast<std::size_t>(covered.side)].back;
            points.emplace_back(turned ? w.y : w.x, turned ? w.x : w.y);
        }
    }
    return points;
}

std::vector<Texel> texels_of(const trace::Geometry& geometry, const Sheet& sheet, const std::vector<Covered>& covered) {
    std::vector<Texel> texels(covered.size());
    for (std::size_t i = 0; i < covered.size(); ++i) {
        const Side& side = sheet.sides[static_cast<std::size_t>(covered[i].side)];
        texels[i].area_m2 = static_cast<float>(covered[i].area_m2);
        fill_texel(texels[i], geometry, side, covered[i].u, covered[i].v,
                   has_detail(geometry, side) ? points_around(sheet, covered[i]) : std::vector<glm::vec2>{});
    }
    return texels;
}

// All sheets at a density, cut where walls stand on them.
struct Sheets {
    std::vector<Sheet> list;
    std::vector<std::pair<int, CutSeam>> seams;  // first sheet of the chart, and the seam of its parts
    bool whole = true;
};

Sheets sheets_at(const trace::Geometry& geometry, const std::vector<Chart>& charts, const std::vector<char>& solids,
                 double texels_per_m, int threads, const std::stop_token& stop) {
    std::vector<Parts> parts(charts.size());
    Sheets result;
    result.whole = trace::parallel(static_cast<int>(charts.size()), threads, false, stop, [&](int i) {
        Sheet sheet = sheet_of(geometry, charts, i, texels_per_m);
        const std::vector<Covered> covered = cover(sheet);
        const std::vector<Texel> texels = texels_of(geometry, sheet, covered);
        parts[static_cast<std::size_t>(i)] =
            split_sheet(std::move(sheet), covered, texels, geometry, solids, 1.0 / texels_per_m);
    });
    for (Parts& part : parts) {
        const auto first = static_cast<int>(result.list.size());
        for (const CutSeam& seam : part.seams) result.seams.emplace_back(first, seam);
        for (Sheet& sheet : part.sheets) result.list.push_back(std::move(sheet));
    }
    return result;
}

}  // namespace

void fill_texel(Texel& texel, const trace::Geometry& geometry, const Side& side, float u, float v,
                const std::vector<glm::vec2>& around) {
    trace::SurfaceHit hit;
    texel.valid = geometry.surface_at(side.instance, side.triangle, u, v, !side.back, hit);
    if (!texel.valid) {
        texel.area_m2 = 0.0f;  // a hole
        return;
    }
    texel.position = hit.position;
    texel.normal = hit.normal;
    texel.geometric = hit.geometric;
    texel.albedo = hit.albedo;
    texel.emission = hit.emission;
    glm::vec3 albedo(0.0f), emission(0.0f);
    int count = 0;
    for (const glm::vec2& p : around) {
        if (!geometry.surface_at(side.instance, side.triangle, p.x, p.y, !side.back, hit)) continue;
        albedo += hit.albedo, emission += hit.emission;
        ++count;
    }
    if (count > 0)
        texel.albedo = albedo / static_cast<float>(count), texel.emission = emission / static_cast<float>(count);
}

void place_sheet(Atlas& atlas, const trace::Geometry& geometry, const Sheet& sheet, const glm::ivec2& at) {
    const auto number = static_cast<int>(atlas.places.size());
    atlas.places.push_back({at - kGutter, at + sheet.size + kGutter});
    const auto first = atlas.sides.size();
    for (std::size_t i = 0; i < sheet.sides.size(); ++i) {
        PlacedSide& placed = atlas.sides.emplace_back();
        placed.side = sheet.sides[i];
        placed.sheet = number;
        for (std::size_t k = 0; k < 3; ++k) {
            const std::size_t corner = placed.side.back && k > 0 ? 3 - k : k;
            placed.corner[corner] = sheet.flat[i][k] + glm::dvec2(at);
        }
    }
    std::vector<int> pieces(sheet.sides.size(), 0);
    for (const Piece& piece : sheet.pieces) ++pieces[static_cast<std::size_t>(piece.side)];
    for (const Piece& piece : sheet.pieces) {
        const auto side = static_cast<std::size_t>(piece.side);
        const Polygon whole(sheet.flat[side].begin(), sheet.flat[side].end());
        if (pieces[side] == 1 && piece.outline == whole) continue;
        Polygon outline = piece.outline;
        for (glm::dvec2& p : outline) p += glm::dvec2(at);
        atlas.sides[first + side].pieces.push_back(std::move(outline));
    }
    const std::vector<Covered> covered = cover(sheet);
    std::vector<Texel> texels = texels_of(geometry, sheet, covered);
    for (std::size_t i = 0; i < covered.size(); ++i) {
        const glm::ivec2 p = covered[i].at + at;
        texels[i].pixel = p.y * atlas.width + p.x;
        texels[i].sheet = number;
        std::int32_t& there = atlas.texel_at[static_cast<std::size_t>(texels[i].pixel)];
        if (there < 0) {
            there = static_cast<std::int32_t>(atlas.texels.size());
            atlas.texels.push_back(texels[i]);
        } else if (atlas.texels[static_cast<std::size_t>(there)].area_m2 < texels[i].area_m2) {
            atlas.texels[static_cast<std::size_t>(there)] = texels[i];  // sheets of a file may share a texel's square
        }
    }
}

int Atlas::texel_of(int instance, int triangle, bool back, float u, float v) const {
    const std::size_t slot =
        static_cast<std::size_t>(first_side[static_cast<std::size_t>(instance)] + 2 * triangle + (back ? 1 : 0));
    const Way& way = ways[slot];
    if (way.whole) {  // around a sheet there are gutters: the texel there is its own
        const glm::ivec2 at(glm::floor(way.corner + u * way.to_second + v * way.to_third));
        if (at.x >= 0 && at.y >= 0 && at.x < width && at.y < height) {
            const std::int32_t texel = texel_at[static_cast<std::size_t>(at.y) * static_cast<std::size_t>(width) +
                                                static_cast<std::size_t>(at.x)];
            if (texel >= 0) return texel;
        }
    }
    return search_texel(slot, u, v);
}

// Where walls cut a side, and on edges.
int Atlas::search_texel(std::size_t slot, float u, float v) const {
    const std::int32_t begin = side_start[slot], end = side_start[slot + 1];
    const auto a = static_cast<double>(u), b = static_cast<double>(v);
    int nearest = -1;
    double least = 1e300;
    for (std::int32_t i = begin; i < end; ++i) {
        const PlacedSide& placed = sides[static_cast<std::size_t>(side_list[static_cast<std::size_t>(i)])];
        const glm::dvec2 p =
            placed.corner[0] + a * (placed.corner[1] - placed.corner[0]) + b * (placed.corner[2] - placed.corner[0]);
        // Where a wall cuts a square both of its parts have a texel of it: the point is on one of them.
        if (end - begin > 1 && std::none_of(placed.pieces.begin(), placed.pieces.end(),
                                            [&](const Polygon& piece) { return contains(piece, p, kOnEdge); }))
            continue;
        const glm::ivec2 at(glm::floor(p));
        const auto texel_here = [&](int x, int y) {
            if (x < 0 || y < 0 || x >= width || y >= height) return -1;
            const std::int32_t texel =
                texel_at[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
            return texel >= 0 && texels[static_cast<std::size_t>(texel)].sheet == placed.sheet ? texel : -1;
        };
        if (const int own = texel_here(at.x, at.y); own >= 0) return own;
        for (int y = at.y - 1; y <= at.y + 1; ++y) {  // on an edge roundings may lead beside it
            for (int x = at.x - 1; x <= at.x + 1; ++x) {
                const int texel = texel_here(x, y);
                if (texel < 0) continue;
                const glm::dvec2 off = glm::max(glm::max(glm::dvec2(x, y) - p, p - glm::dvec2(x + 1, y + 1)), 0.0);
                const double distance = glm::dot(off, off);
                if (distance < least) least = distance, nearest = texel;
            }
        }
    }
    return nearest;
}

void Atlas::index_sides(const SceneAsset& asset) {
    first_side.clear();
    std::int32_t slots = 0;
    for (const Instance& instance : asset.instances) {
        first_side.push_back(slots);
        slots +=
            2 * static_cast<std::int32_t>(asset.meshes[static_cast<std::size_t>(instance.mesh)].indices.size() / 3);
    }
    const auto slot_of = [&](const Side& side) {
        return static_cast<std::size_t>(first_side[static_cast<std::size_t>(side.instance)] + 2 * side.triangle +
                                        (side.back ? 1 : 0));
    };
    side_start.assign(static_cast<std::size_t>(slots) + 1, 0);
    for (const PlacedSide& placed : sides) ++side_start[slot_of(placed.side) + 1];
    for (std::size_t i = 1; i < side_start.size(); ++i) side_start[i] += side_start[i - 1];
    side_list.resize(sides.size());
    std::vector<std::int32_t> next(side_start.begin(), side_start.end() - 1);
    for (std::size_t i = 0; i < sides.size(); ++i)
        side_list[static_cast<std::size_t>(next[slot_of(sides[i].side)]++)] = static_cast<std::int32_t>(i);
    ways.assign(static_cast<std::size_t>(slots), {});
    for (const PlacedSide& placed : sides) {
        const std::size_t slot = slot_of(placed.side);
        if (side_start[slot + 1] - side_start[slot] != 1) continue;
        ways[slot] = {glm::vec2(placed.corner[0]), glm::vec2(placed.corner[1] - placed.corner[0]),
                      glm::vec2(placed.corner[2] - placed.corner[0]), true};
    }
}

bool sees(const trace::Geometry& geometry, const Texel& a, const Texel& b, float above_m) {
    if (!a.valid || !b.valid) return false;
    const auto over = [&](const Texel& t) {
        return t.position + t.geometric * std::max(above_m, geometry.step_off(t.position));
    };
    return !geometry.occluded(over(a), over(b)) && !geometry.occluded(over(b), over(a));
}

Result<Atlas> make_atlas(const trace::Geometry& geometry, const AtlasSettings& settings, const std::stop_token& stop) {
    if (settings.width < 16 || settings.height < 16 || settings.width > kMostSide || settings.height > kMostSide)
        return Error{"invalid_argument", "bake.size",
                     std::to_string(settings.width) + "x" + std::to_string(settings.height),
                     "must be from 16 to " + std::to_string(kMostSide) + " texels a side"};
    if (settings.second_uv) return second_uv_atlas(geometry, settings);
    const glm::ivec2 room(settings.width, settings.height);
    std::vector<Chart> charts = grow_charts(geometry);
    if (charts.empty()) return Error{"invalid_argument", "bake.scene", "", "the scene has no surfaces to bake"};
    std::optional<double> finest = finest_density(charts, settings);
    // As fine as it would be without gutters; where that is far off small charts bend more.
    const double ideal = settings.texel_m > 0.0 ? 1.0 / settings.texel_m
                                                : std::sqrt(static_cast<double>(room.x) * room.y / area_of(charts));
    if (!finest || *finest < kGood * ideal) {
        std::vector<Chart> bent = grow_charts(geometry, kChartAngle_rad, kSmallTexels / (ideal * ideal));
        const std::optional<double> other = finest_density(bent, settings);
        if (other && *other > finest.value_or(0.0)) charts = std::move(bent), finest = other;
    }
    if (!finest)
        return too_small(settings, std::to_string(charts.size()) + " charts and the gutters around them do not fit");
    double density = *finest, longest = 0.0;
    for (const Chart& chart : charts) longest = std::max({longest, chart.size_m.x, chart.size_m.y});
    const std::vector<char> solids = solids_of(geometry);
    Sheets sheets;
    std::optional<std::vector<glm::ivec2>> placed;
    while (!placed) {
        sheets = sheets_at(geometry, charts, solids, density, settings.threads, stop);
        if (!sheets.whole) return Error{"stopped", "bake", "", "the bake was stopped"};
        const std::vector<glm::ivec2> sizes = with_gutters(sheets.list);
        placed = pack(sizes, room);
        if (placed) break;
        double needed = 0.0;
        for (const glm::ivec2& size : sizes) needed += static_cast<double>(size.x) * size.y;
        if (settings.texel_m > 0.0 || density * longest < 1.0)
            return too_small(settings, std::to_string(sheets.list.size()) + " charts, cut at walls, do not fit");
        density *= std::min(kShrink, kShrink * std::sqrt(static_cast<double>(room.x) * room.y / needed));
    }
    Atlas atlas;
    atlas.width = room.x, atlas.height = room.y;
    atlas.texels_per_m = density;
    atlas.texel_at.assign(static_cast<std::size_t>(room.x) * static_cast<std::size_t>(room.y), -1);
    for (std::size_t i = 0; i < sheets.list.size(); ++i)
        place_sheet(atlas, geometry, sheets.list[i], (*placed)[i] + kGutter);
    atlas.index_sides(geometry.asset());
    find_seams(atlas, geometry);
    for (const auto& [first, cut] : sheets.seams) {
        Seam& seam = atlas.seams.emplace_back();
        for (int s = 0; s < 2; ++s) {
            seam.sheet[s] = first + cut.part[s];
            const glm::dvec2 corner(glm::dvec2((*placed)[static_cast<std::size_t>(seam.sheet[s])] + kGutter));
            seam.from[s] = cut.from[s] + corner;
            seam.to[s] = cut.to[s] + corner;
        }
    }
    return atlas;
}

}  // namespace gonio::bake
