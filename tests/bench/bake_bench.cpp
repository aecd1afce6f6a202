#include "tests/bench/bake_bench.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <nlohmann/json.hpp>
#include <numbers>
#include <ostream>
#include <stdexcept>
#include <vector>

#include "server/assets/assets.h"
#include "server/bake/bake.h"
#include "server/bake/seams.h"
#include "server/base/clock.h"
#include "server/render/renderer.h"
#include "server/scene/apply.h"
#include "server/scene/scene.h"
#include "server/trace/reference.h"
#include "server/trace/sources.h"
#include "tests/bench/cases.h"
#include "tests/bench/errors.h"
#include "tests/bench/receivers.h"
#include "tests/scenes/show.h"

namespace gonio::bench {
namespace {

constexpr int kCells = 24;  // a side of the picture: one point in each
constexpr double kReferenceNoise = 0.01;

// A bake in memory, and what it came to.
struct Baked {
    std::shared_ptr<const trace::Geometry> geometry;
    bake::Layout layout;
    std::vector<float> direct, indirect;  // of texels, at the scene's levels, three channels
    std::vector<double> mean_bounces_lx;
    double mean_direct_lx = 0.0, mean_lx = 0.0, error_lx = 0.0;
    double layout_s = 0.0, seconds = 0.0, cpu_s = 0.0;
    std::uint64_t rays = 0;
};

template <typename T>
T value_of(Result<T> result) {
    if (!result) throw std::runtime_error(result.error().text());
    return std::move(*result);
}

Baked bake_in_memory(const Scene& scene, const bake::BakeSettings& settings, std::ostream& progress) {
    Baked baked;
    bake::Work work;
    const std::int64_t begin_ns = monotonic_ns();
    const std::clock_t begin_cpu = std::clock();
    baked.geometry = trace::geometry_of(scene);
    baked.layout = value_of(bake::lay_out(scene, *baked.geometry, settings, work));
    baked.layout_s = seconds_since(begin_ns);
    const auto sources = value_of(bake::sources_of(scene, *baked.geometry, settings));
    const std::size_t texels = baked.layout.atlas.texels.size();
    baked.direct.assign(3 * texels, 0.0f);
    baked.indirect.assign(3 * texels, 0.0f);
    std::vector<float> error2(texels, 0.0f);
    bake::BakeEvents events;
    events.begins = [&](const std::string& what, int, int) { progress << "  " << what << std::endl; };
    events.finished = [&](const bake::Layout&, const bake::Source& source,
                          const bake::SourceMaps& maps) -> Result<bool> {
        for (std::size_t i = 0; i < texels; ++i) {
            for (std::size_t c = 0; c < 3; ++c) {
                const float weight = source.weight[static_cast<int>(c)];
                baked.direct[3 * i + c] +=
                    weight * (source.direct_channels == 3 ? maps.direct[3 * i + c] : maps.direct[i]);
                baked.indirect[3 * i + c] += weight * maps.indirect[3 * i + c];
            }
            const float error = trace::luminance(source.weight) * maps.error[i];
            error2[i] += error * error;
        }
        baked.mean_bounces_lx.resize(std::max(baked.mean_bounces_lx.size(), maps.mean_bounces_lx.size()), 0.0);
        for (std::size_t n = 0; n < maps.mean_bounces_lx.size(); ++n)
            baked.mean_bounces_lx[n] += maps.mean_bounces_lx[n];
        return true;
    };
    value_of(bake::bake(scene, *baked.geometry, baked.layout, sources, settings, bake::PartStore(), events, work));
    baked.mean_direct_lx = bake::mean_over_area(baked.layout, baked.direct, 3);
    baked.mean_lx = baked.mean_direct_lx + bake::mean_over_area(baked.layout, baked.indirect, 3);
    baked.error_lx = std::sqrt(bake::mean_over_area(baked.layout, error2, 1));
    baked.rays = work.rays;
    baked.seconds = seconds_since(begin_ns);
    baked.cpu_s = static_cast<double>(std::clock() - begin_cpu) / CLOCKS_PER_SEC;
    return baked;
}

// Result: what a map's picture shows at a point of a surface, bilinear; -1 where no map shows it.
double shown_at(const Baked& baked, const std::vector<float>& picture, const glm::dvec3& position,
                const glm::dvec3& normal) {
    trace::RayPacket rays;
    trace::HitPacket hits;
    const glm::vec3 n(normal);
    const float off = 1e-3f * baked.geometry->extent();
    rays.set(0, baked.geometry->local(position) + n * off, -n);
    if (baked.geometry->closest(rays, 1u, hits) == 0 || hits.distance[0] > 2.0f * off) return -1.0;
    const bake::Atlas& atlas = baked.layout.atlas;
    const bool back = glm::dot(hits.normal(0), rays.along(0)) > 0.0f;
    const int texel = atlas.texel_of(static_cast<int>(hits.instance[0]), static_cast<int>(hits.triangle[0]), back,
                                     hits.u[0], hits.v[0]);
    if (texel < 0) return -1.0;
    const auto slot =
        static_cast<std::size_t>(atlas.first_side[hits.instance[0]]) + 2 * hits.triangle[0] + (back ? 1u : 0u);
    glm::dvec2 at(0.0);
    for (std::int32_t i = atlas.side_start[slot]; i < atlas.side_start[slot + 1]; ++i) {
        const bake::PlacedSide& placed =
            atlas.sides[static_cast<std::size_t>(atlas.side_list[static_cast<std::size_t>(i)])];
        if (placed.sheet == atlas.texels[static_cast<std::size_t>(texel)].sheet)
            at = placed.corner[0] + static_cast<double>(hits.u[0]) * (placed.corner[1] - placed.corner[0]) +
                 static_cast<double>(hits.v[0]) * (placed.corner[2] - placed.corner[0]);
    }
    glm::dvec3 rgb;
    for (int c = 0; c < 3; ++c)
        rgb[c] = static_cast<double>(bake::bilinear(picture, atlas.width, atlas.height, 3, c, at));
    return trace::luminance(rgb);
}

std::vector<float> finished(const Baked& baked, const std::vector<float>& values) {
    std::vector<float> picture = bake::picture_of(baked.layout.atlas, baked.layout.fill, values, 3);
    bake::level_seams(baked.layout.atlas, baked.layout.fill, picture, 3);
    return picture;
}

struct BakeRow {
    std::string scene;
    Baked baked;
    Errors maps, live;
    double live_s = 0.0;  // until the live transport rests
    std::size_t points = 0;
};

// Luminaires as points, as the live transport has them.
BakeRow compare(const gl::Context& context, const std::string& name, const BakeBenchOptions& options,
                std::ostream& progress) {
    BakeRow row;
    row.scene = name;
    Scene scene = scene_of(bench_asset(name));
    scene.width_px = options.width_px, scene.height_px = options.height_px;
    bake::BakeSettings settings;
    settings.atlas.width = settings.atlas.height = options.side;
    settings.directions = options.directions;
    settings.openings = false;
    progress << name << ": maps\n";
    row.baked = bake_in_memory(scene, settings, progress);
    progress << name << ": live\n";
    const std::int64_t begin_ns = monotonic_ns();
    Renderer renderer(context);
    test::show(renderer, scene);
    row.live_s = seconds_since(begin_ns);
    const auto receivers = receivers_of(scene, stratified_pixels(scene.width_px, scene.height_px, kCells));
    std::vector<trace::MeterPoint> points;
    for (const Receiver& receiver : receivers) points.push_back({receiver.position, receiver.normal});
    progress << name << ": reference\n";
    trace::Settings traced;
    traced.noise = kReferenceNoise;
    traced.max_seconds = options.reference_seconds;
    const auto readings = trace::measure(*trace::make_world(scene), points, traced);
    const std::vector<double> live = shown_lx(renderer.live_illuminance(scene, true), scene.width_px, receivers);
    const std::vector<float> picture = finished(row.baked, row.baked.indirect);
    std::vector<double> shown, of_live, truth, variance;
    for (std::size_t i = 0; i < receivers.size(); ++i) {
        const double lx = shown_at(row.baked, picture, receivers[i].position, receivers[i].normal);
        if (lx < 0.0) continue;
        shown.push_back(lx);
        of_live.push_back(live[i]);
        truth.push_back(trace::luminance(readings[i].indirect_lx));
        variance.push_back(readings[i].indirect_error_lx * readings[i].indirect_error_lx);
    }
    row.points = shown.size();
    row.maps = errors_of(shown, truth, variance);
    row.live = errors_of(of_live, truth, variance);
    return row;
}

// docs/lightmaps.md: the cylinder's values by quadrature.
struct Place {
    const char* name;
    double azimuth_deg, radius_m, z_m, direct_lx, bounce_lx;
};
constexpr Place kPlaces[] = {
    {"wall 60, z = 0", 60, 8, 0, 81.520, 13.50},      {"wall 60, z = -10", 60, 8, -10, 114.721, 13.52},
    {"wall 10, z = -10", 10, 8, -10, 95.530, 13.60},  {"wall 30, z = 10", 30, 8, 10, 110.966, 13.87},
    {"wall 60, z = 19", 60, 8, 19, 52.016, 11.65},    {"cap -20, centre", 0, 0, -20, 110.34, 12.93},
    {"cap -20, r = 4, 60", 60, 4, -20, 95.016, 12.47}};
constexpr double kMeanDirect = 86.328, kMeanBounce = 12.949, kMeanAll = 101.563, kArea = 2412.743;

// The means of a closed scene follow from its own area.
nlohmann::json cylinder_table(const BakeBenchOptions& options, std::ostream& progress) {
    Scene scene = scene_of(make_cylinder());
    bake::BakeSettings settings;
    settings.atlas.width = settings.atlas.height = options.side;
    settings.directions = options.directions;
    progress << "cylinder: means\n";
    const Baked all = bake_in_memory(scene, settings, progress);
    settings.bounces = 1;
    progress << "cylinder: points\n";
    const Baked once = bake_in_memory(scene, settings, progress);
    const std::vector<float> direct = finished(once, once.direct), bounce = finished(once, once.indirect);
    std::vector<trace::MeterPoint> points;
    for (const Place& place : kPlaces) {
        const double azimuth = place.azimuth_deg * std::numbers::pi / 180.0;
        const glm::dvec3 normal = std::abs(place.z_m) == 20.0 ? glm::dvec3(0, 0, place.z_m > 0.0 ? -1 : 1)
                                                              : glm::dvec3(-std::cos(azimuth), -std::sin(azimuth), 0);
        points.push_back({{place.radius_m * std::cos(azimuth), place.radius_m * std::sin(azimuth), place.z_m}, normal});
    }
    trace::Settings traced;
    traced.bounces = 1;
    traced.noise = 0.002;
    traced.max_seconds = options.reference_seconds;
    // On the facets, not on the circle that they are within.
    for (trace::MeterPoint& point : points) {
        trace::SurfaceHit hit;
        if (all.geometry->closest(all.geometry->local(point.position + 0.1 * point.normal), -glm::vec3(point.normal),
                                  0.0f, false, hit))
            point.position = glm::dvec3(hit.position) + all.geometry->origin();
    }
    const auto readings = trace::measure(*trace::make_world(scene), points, traced);
    nlohmann::json table = nlohmann::json::array();
    const double own = kArea / all.layout.area_m2;
    const auto add = [&](const char* what, double expected, double reference, double maps) {
        table.push_back({{"what", what}, {"expected_lx", expected}, {"reference_lx", reference}, {"maps_lx", maps}});
    };
    add("mean direct", kMeanDirect * own, NAN, all.mean_direct_lx);
    add("mean one bounce", kMeanBounce * own, NAN, all.mean_bounces_lx.at(0));
    add("mean all bounces", kMeanAll * own, NAN, all.mean_lx);
    for (std::size_t i = 0; i < points.size(); ++i) {
        const std::string name = kPlaces[i].name;
        add((name + ", direct").c_str(), kPlaces[i].direct_lx, trace::luminance(readings[i].direct_lx),
            shown_at(once, direct, points[i].position, points[i].normal));
        add((name + ", one bounce").c_str(), kPlaces[i].bounce_lx, trace::luminance(readings[i].indirect_lx),
            shown_at(once, bounce, points[i].position, points[i].normal));
    }
    return table;
}

// The seed's air, scaled with its world: Rayleigh's green coefficient times 1,000, isotropic.
constexpr HazeValues kSeedAir{13.5e-3, 1.0, 0.0, 0.0};
constexpr int kSeedSide = 2304, kSeedDirections = 256, kSeedSteps = 30;

// line: where each row goes when it is there, as text; the one with air takes hours at full size.
nlohmann::json seed_case(const BakeBenchOptions& options, std::ostream* line, std::ostream& progress) {
    Scene scene = scene_of(make_cylinder());
    bake::BakeSettings settings;
    settings.atlas.width = settings.atlas.height =
        std::max(16, static_cast<int>(std::lround(kSeedSide * options.share)));
    settings.directions = kSeedDirections;
    settings.steps = kSeedSteps;
    settings.even_steps = true;
    settings.bounces = 1;
    settings.tolerance = 0.0;
    settings.memory_bytes = std::size_t{64} << 30;
    nlohmann::json rows = nlohmann::json::array();
    for (const bool air : {false, true}) {
        scene.haze = air ? kSeedAir : HazeValues{};
        progress << "the seed's case " << (air ? "with" : "without") << " air, " << settings.atlas.width
                 << " texels a side\n";
        const Baked baked = bake_in_memory(scene, settings, progress);
        // What the seed compares: the mean of what surfaces send, over the product of the means.
        double sent = 0.0, albedo = 0.0;
        for (std::size_t i = 0; i < baked.layout.atlas.texels.size(); ++i) {
            const bake::Texel& texel = baked.layout.atlas.texels[i];
            if (!texel.valid) continue;
            const double rho = static_cast<double>(trace::luminance(texel.albedo)),
                         area = static_cast<double>(texel.area_m2);
            sent += area * rho * static_cast<double>(baked.direct[3 * i]);
            albedo += area * rho;
        }
        const double product = albedo * baked.mean_direct_lx;
        rows.push_back({{"air", air},
                        {"side", settings.atlas.width},
                        {"texels", baked.layout.atlas.texels.size()},
                        {"seconds", baked.seconds},
                        {"cpu_s", baked.cpu_s},
                        {"seconds_whole", baked.seconds / (options.share * options.share)},
                        {"rays_per_s", static_cast<double>(baked.rays) / baked.seconds},
                        {"mean_direct_lx", baked.mean_direct_lx},
                        {"mean_lx", baked.mean_lx},
                        {"sent_over_product", product > 0.0 ? sent / product : 0.0}});
        const nlohmann::json& row = rows.back();
        if (line != nullptr)
            *line << (air ? "with air: " : "without air: ") << row["side"] << " texels a side, " << row["seconds"]
                  << " s (" << row["seconds_whole"] << " s for " << kSeedSide << "; " << row["cpu_s"] << " s of CPU), "
                  << row["rays_per_s"].get<double>() * 1e-6 << " M rays/s, mean direct " << row["mean_direct_lx"]
                  << " lx, all " << row["mean_lx"] << " lx, sent over the product of means " << row["sent_over_product"]
                  << std::endl;
    }
    return rows;
}

void print_table(const nlohmann::json& table, std::ostream& out) {
    char line[160];
    std::snprintf(line, sizeof line, "%-34s %10s %10s %10s\n", "cylinder, lx", "expected", "reference", "maps");
    out << line;
    for (const nlohmann::json& row : table) {
        const bool traced = row["reference_lx"].is_number() && std::isfinite(row["reference_lx"].get<double>());
        std::snprintf(line, sizeof line, "%-34s %10.3f %10s %10.3f\n", row["what"].get<std::string>().c_str(),
                      row["expected_lx"].get<double>(),
                      traced ? std::to_string(row["reference_lx"].get<double>()).substr(0, 8).c_str() : "-",
                      row["maps_lx"].get<double>());
        out << line;
    }
}

}  // namespace

void run_bake(const BakeBenchOptions& options, std::ostream& out, std::ostream& progress) {
    nlohmann::json document;
    if (options.reference_case) {
        document["reference_case"] = seed_case(options, options.json ? nullptr : &out, progress);
        if (options.json) out << document.dump(2) << "\n";
        return;
    }
    const auto context = gl::Context::create({options.device, false});
    std::vector<std::string> scenes{"cornell", "atrium", "cylinder"};
    if (!options.scene.empty()) scenes = {options.scene};
    document["renderer"] = context->renderer();
    char line[320];
    for (const std::string& name : scenes) {
        const BakeRow row = compare(*context, name, options, progress);
        const Baked& baked = row.baked;
        document["rows"].push_back({{"scene", name},
                                    {"side", options.side},
                                    {"directions", options.directions},
                                    {"charts", baked.layout.atlas.places.size()},
                                    {"texels", baked.layout.atlas.texels.size()},
                                    {"layout_s", baked.layout_s},
                                    {"seconds", baked.seconds},
                                    {"rays_per_s", static_cast<double>(baked.rays) / baked.seconds},
                                    {"bounces", baked.mean_bounces_lx.size()},
                                    {"mean_lx", baked.mean_lx},
                                    {"stated_error", baked.error_lx / baked.mean_lx},
                                    {"points", row.points},
                                    {"rmse", row.maps.rmse},
                                    {"rmse99", row.maps.rmse99},
                                    {"bias", row.maps.bias},
                                    {"live_s", row.live_s},
                                    {"live_rmse", row.live.rmse},
                                    {"live_rmse99", row.live.rmse99},
                                    {"live_bias", row.live.bias},
                                    {"noise", row.maps.noise}});
        if (options.json) continue;
        std::snprintf(
            line, sizeof line,
            "%s: %d texels a side, %zu charts, %.1f s (%.1f of charts), %.2f M rays/s, stated error %.3f; rmse %.3f, "
            "rmse99 %.3f, bias %+.3f; live %.1f s, rmse %.3f, rmse99 %.3f, bias %+.3f; reference's noise %.3f\n",
            name.c_str(), options.side, baked.layout.atlas.places.size(), baked.seconds, baked.layout_s,
            1e-6 * static_cast<double>(baked.rays) / baked.seconds, baked.error_lx / baked.mean_lx, row.maps.rmse,
            row.maps.rmse99, row.maps.bias, row.live_s, row.live.rmse, row.live.rmse99, row.live.bias, row.maps.noise);
        out << line;
    }
    if (std::find(scenes.begin(), scenes.end(), "cylinder") != scenes.end()) {
        document["cylinder"] = cylinder_table(options, progress);
        if (!options.json) print_table(document["cylinder"], out);
    }
    if (options.json) out << document.dump(2) << "\n";
}

}  // namespace gonio::bench
