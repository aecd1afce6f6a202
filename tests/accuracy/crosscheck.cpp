#include "tests/accuracy/crosscheck.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <numbers>
#include <sstream>
#include <stdexcept>

#include "ies/quantities.h"
#include "server/assets/assets.h"
#include "server/render/renderer.h"
#include "server/scene/apply.h"
#include "server/scene/orientation.h"
#include "server/scene/scene.h"
#include "server/trace/geometry.h"
#include "server/trace/reference.h"
#include "tests/accuracy/table.h"
#include "tests/scenes/write_glb.h"

namespace gonio::accuracy {
namespace {

constexpr std::size_t kPixels = static_cast<std::size_t>(kCrossPx) * kCrossPx;
constexpr int kBlock = 16;              // px, 8 x 8 blocks
constexpr std::uint32_t kPasses = 256;  // of the reference's pictures, fixed: the same figures each time

struct Run {
    const char *name, *profile;
    PanTiltRoll turn;
    glm::dvec3 position;
};
// The built-in scene's own luminaire, and one without any symmetry turned about all three axes.
const Run kRuns[] = {{"wide", "batwing", {0.0, 0.0, 0.0}, {0.0, 3.88, 0.6}},
                     {"asymmetric", "wall_washer", {0.5, 0.6, 1.1}, {0.9, 3.0, 0.9}}};

std::string glb_path(const std::string& directory, const std::string& run) {
    return directory + "/" + run + ".glb";
}

struct Rgb {
    std::vector<glm::dvec3> lux;  // per pixel from the top
};

double luminance(const glm::dvec3& rgb) {
    return glm::dot(rgb, glm::dvec3(0.2126, 0.7152, 0.0722));
}

Rgb rgb_of(const std::vector<float>& values, std::size_t channels) {
    Rgb picture;
    for (std::size_t i = 0; i < kPixels; ++i) {
        const float* v = &values[i * channels];
        picture.lux.emplace_back(v[0], v[1], v[2]);
    }
    return picture;
}

Rgb read_cycles(const std::string& path) {
    const auto picture = read_picture(path);
    if (!picture) throw std::runtime_error(path + ": " + picture.error().text());
    if (picture->width_px != kCrossPx || picture->height_px != kCrossPx || picture->channels != 3)
        throw std::runtime_error(path + ": not a picture of the size that was asked for");
    return rgb_of(picture->values, 3);
}

std::vector<float> trace_picture(const std::shared_ptr<const trace::World>& world, const Scene& scene,
                                 trace::Quantity quantity) {
    trace::Settings settings;
    settings.bounces = 1;
    settings.noise = 0.0;
    settings.max_passes = kPasses;
    trace::Picture picture(world, {scene.camera, kCrossPx, kCrossPx, quantity, true}, settings);
    while (!picture.refine(1.0).complete) {
    }
    return picture.values();
}

// Pixels that are all surface, and so are their neighbours: where the filters of two renderers cannot differ.
std::vector<bool> filled_pixels(const std::vector<float>& values) {
    std::vector<bool> filled(kPixels);
    for (int y = 1; y + 1 < kCrossPx; ++y) {
        for (int x = 1; x + 1 < kCrossPx; ++x) {
            bool all = true;
            for (int dy = -1; dy <= 1; ++dy) {
                for (int dx = -1; dx <= 1; ++dx)
                    all &= values[static_cast<std::size_t>((y + dy) * kCrossPx + x + dx) * 4 + 3] > 0.999f;
            }
            filled[static_cast<std::size_t>(y * kCrossPx + x)] = all;
        }
    }
    return filled;
}

glm::dvec3 mean(const Rgb& picture, const std::vector<bool>& counted) {
    glm::dvec3 sum(0.0);
    double n = 0.0;
    for (std::size_t i = 0; i < kPixels; ++i) {
        if (counted[i]) sum += picture.lux[i], n += 1.0;
    }
    return sum / std::max(n, 1.0);
}

// Root mean square over blocks with enough counted pixels, relative to the mean of `truth`.
double block_difference(const Rgb& picture, const Rgb& truth, const std::vector<bool>& counted) {
    double squares = 0.0, blocks = 0.0;
    for (int by = 0; by < kCrossPx; by += kBlock) {
        for (int bx = 0; bx < kCrossPx; bx += kBlock) {
            std::vector<bool> here(kPixels);
            int n = 0;
            for (int y = by; y < by + kBlock; ++y) {
                for (int x = bx; x < bx + kBlock; ++x) {
                    const auto i = static_cast<std::size_t>(y * kCrossPx + x);
                    here[i] = counted[i];
                    n += counted[i];
                }
            }
            if (n < kBlock * kBlock / 4) continue;
            squares += std::pow(luminance(mean(picture, here) - mean(truth, here)), 2.0);
            blocks += 1.0;
        }
    }
    return std::sqrt(squares / std::max(blocks, 1.0)) / luminance(mean(truth, counted));
}

// The interactive picture's illuminance, split by the two views that show each part times albedo / pi.
void interactive_pictures(const gl::Context& context, const Scene& scene, Rgb& direct, Rgb& indirect) {
    Renderer renderer(context);
    const auto total = renderer.capture(scene, View::illuminance, kCrossPx, kCrossPx, true, 1);
    const auto d = renderer.capture(scene, View::direct, kCrossPx, kCrossPx, true, 1);
    const auto i = renderer.capture(scene, View::indirect, kCrossPx, kCrossPx, true, 1);
    const Rgb all = rgb_of(total->values, 4), by_direct = rgb_of(d->values, 4), by_indirect = rgb_of(i->values, 4);
    for (std::size_t p = 0; p < kPixels; ++p) {
        glm::dvec3 share(0.0);
        for (int k = 0; k < 3; ++k) {
            const double sum = by_direct.lux[p][k] + by_indirect.lux[p][k];
            if (sum > 0.0) share[k] = by_direct.lux[p][k] / sum;
        }
        direct.lux.push_back(all.lux[p] * share);
        indirect.lux.push_back(all.lux[p] * (1.0 - share));
    }
}

struct GridPoint {
    std::size_t pixel;
    glm::dvec3 position, normal;  // world
};
// Where the rays through the centres of every 8th pixel meet the scene.
std::vector<GridPoint> grid_points(const Scene& scene, const std::vector<bool>& filled) {
    const trace::Geometry geometry(scene.asset);
    const glm::dvec3 forward = glm::normalize(scene.camera.target - scene.camera.eye),
                     right = glm::normalize(glm::cross(forward, glm::dvec3(0, 1, 0))), up = glm::cross(right, forward);
    const double half = std::tan(scene.camera.fov_rad / 2);
    std::vector<GridPoint> points;
    for (int y = 4; y < kCrossPx; y += 8) {
        for (int x = 4; x < kCrossPx; x += 8) {
            const auto pixel = static_cast<std::size_t>(y * kCrossPx + x);
            const double s = ((x + 0.5) / kCrossPx * 2 - 1) * half, t = (1 - (y + 0.5) / kCrossPx * 2) * half;
            const glm::vec3 ray(glm::normalize(forward + s * right + t * up));
            trace::SurfaceHit hit;
            if (!filled[pixel] || !geometry.closest(geometry.local(scene.camera.eye), ray, 0.0f, true, hit)) continue;
            points.push_back({pixel, glm::dvec3(hit.position) + geometry.origin(), glm::dvec3(hit.normal)});
        }
    }
    return points;
}

CrossRow row_of(const std::string& run, const std::string& part, const Rgb& cycles, const Rgb& reference,
                const Rgb& interactive, const std::vector<bool>& filled) {
    const glm::dvec3 truth = mean(cycles, filled), ours = mean(reference, filled);
    CrossRow row{run, part, luminance(truth), luminance(ours), luminance(mean(interactive, filled))};
    for (int k = 0; k < 3; ++k) row.worst_channel = std::max(row.worst_channel, std::abs(ours[k] / truth[k] - 1));
    row.reference_blocks = block_difference(reference, cycles, filled);
    row.interactive_blocks = block_difference(interactive, cycles, filled);
    return row;
}

// Three times as much light on the side of C90 as on that of C270: tells the senses of turn apart.
void make_lopsided(ies::PhotometricWeb& web) {
    for (std::size_t h = 0; h < web.h_rad.size(); ++h) {
        for (std::size_t v = 0; v < web.v_rad.size(); ++v) {
            const double factor = 1.0 + 0.5 * std::sin(web.v_rad[v]) * std::sin(web.h_rad[h]);
            web.candela[h * web.v_rad.size() + v] *= static_cast<float>(factor);
        }
    }
}

}  // namespace

std::vector<std::string> write_cross_scenes(const std::string& directory) {
    std::vector<std::string> names;
    for (const Run& run : kRuns) {
        SceneAsset asset = *make_cornell();
        // On a grid of one degree: Cycles interpolates by cubics where the web here is linear between its angles.
        auto profile = std::make_shared<Profile>(**builtin_profile(run.profile));
        profile->photometry.opening = {};  // a point, as Cycles has it
        profile->photometry.web = ies::as_type_c(profile->photometry.web, Angle::degrees(1.0));
        if (std::string(run.name) == "asymmetric") make_lopsided(profile->photometry.web);
        asset.lights.at(0).profile = profile;
        asset.lights[0].position = run.position;
        asset.lights[0].world_from_light = orientation_of(run.turn);
        const auto bytes = test::write_glb(asset);
        if (!bytes) throw std::runtime_error(bytes.error().text());
        std::ofstream file(glb_path(directory, run.name), std::ios::binary);
        if (!(file << *bytes).flush()) throw std::runtime_error("cannot write " + glb_path(directory, run.name));
        names.emplace_back(run.name);
    }
    return names;
}

std::vector<CrossRow> compare_with_cycles(const gl::Context& context, const std::string& directory) {
    std::vector<CrossRow> rows;
    for (const Run& run : kRuns) {
        const auto asset = load_scene(glb_path(directory, run.name));
        if (!asset) throw std::runtime_error(asset.error().text());
        const Scene scene = scene_of(*asset);
        const auto world = trace::make_world(scene);
        const auto direct = trace_picture(world, scene, trace::Quantity::irradiance_direct),
                   indirect = trace_picture(world, scene, trace::Quantity::irradiance_indirect);
        const std::vector<bool> filled = filled_pixels(direct);
        const std::string stem = directory + "/" + run.name;
        const Rgb cycles_direct = read_cycles(stem + "-direct.exr"),
                  cycles_indirect = read_cycles(stem + "-indirect.exr");
        Rgb live_direct, live_indirect;
        interactive_pictures(context, scene, live_direct, live_indirect);
        CrossRow rows_of_run[2] = {
            row_of(run.name, "direct", cycles_direct, rgb_of(direct, 4), live_direct, filled),
            row_of(run.name, "one bounce", cycles_indirect, rgb_of(indirect, 4), live_indirect, filled)};
        Renderer renderer(context);
        const std::vector<GridPoint> points = grid_points(scene, filled);
        for (const GridPoint& point : points) {
            const auto reading = renderer.meter(scene, point.position, point.normal, Renderer::MeterQuality::rsm);
            const double share = 1.0 / static_cast<double>(points.size());
            rows_of_run[0].rsm_at_points += share * reading.direct_lx();
            rows_of_run[1].rsm_at_points += share * reading.indirect_lx();
            rows_of_run[0].cycles_at_points += share * luminance(cycles_direct.lux[point.pixel]);
            rows_of_run[1].cycles_at_points += share * luminance(cycles_indirect.lux[point.pixel]);
        }
        rows.insert(rows.end(), rows_of_run, rows_of_run + 2);
    }
    return rows;
}

std::string cross_markdown(const std::vector<CrossRow>& rows) {
    std::ostringstream out;
    out << "| luminaire | light | Cycles, lx | reference, lx | difference | blocks, rms | interactive | blocks, rms | "
           "rsm, at points |\n|---|---|---|---|---|---|---|---|---|\n";
    for (const CrossRow& row : rows) {
        char text[256];
        std::snprintf(text, sizeof text, "| %s | %s | %.2f | %.2f | %s | %.2f %% | %s | %.2f %% | %s |\n",
                      row.run.c_str(), row.part.c_str(), row.cycles, row.reference,
                      percent(row.reference / row.cycles - 1).c_str(), 100 * row.reference_blocks,
                      percent(row.interactive / row.cycles - 1).c_str(), 100 * row.interactive_blocks,
                      percent(row.rsm_at_points / row.cycles_at_points - 1).c_str());
        out << text;
    }
    return out.str();
}

}  // namespace gonio::accuracy
