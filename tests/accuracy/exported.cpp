#include "tests/accuracy/exported.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "server/assets/assets.h"
#include "server/render/renderer.h"
#include "server/scene/apply.h"
#include "server/scene/scene.h"
#include "server/trace/reference.h"

namespace gonio::accuracy {
namespace {

constexpr double kEyeHeight_m = 0.02, kSeen_m = 0.002;  // as probe.py looks at a point

struct Point {
    std::string group, light, quantity;
    glm::dvec3 position{0.0}, normal{0.0}, cycles{0.0};
    std::optional<glm::dvec3> closed_form, whole;  // whole: what differences are relative to, else the truth
};

glm::dvec3 vector_of(const nlohmann::json& list) {
    return {list.at(0).get<double>(), list.at(1).get<double>(), list.at(2).get<double>()};
}

std::vector<Point> points_of(const nlohmann::json& expected) {
    std::vector<Point> points;
    for (const auto& from : expected.at("points")) {
        Point& point = points.emplace_back();
        point.group = from.at("group").get<std::string>();
        point.light = from.at("light").get<std::string>();
        point.quantity = from.at("quantity").get<std::string>();
        point.position = vector_of(from.at("point_m"));
        point.normal = vector_of(from.at("normal"));
        point.cycles = vector_of(from.at("cycles"));
        if (!from.at("closed_form").is_null()) point.closed_form = vector_of(from.at("closed_form"));
        if (from.contains("whole")) point.whole = vector_of(from.at("whole"));
    }
    return points;
}

void check_camera(const SceneAsset& asset, const nlohmann::json& expected) {
    if (asset.cameras.size() != 1) throw std::runtime_error("one camera was exported, others came");
    const Camera& camera = asset.cameras[0];
    const glm::dvec3 aim = glm::normalize(camera.target - camera.eye);
    if (glm::distance(camera.eye, vector_of(expected.at("eye_m"))) > 1e-4 ||
        glm::distance(aim, vector_of(expected.at("aim"))) > 1e-4 ||
        std::abs(camera.fov_rad - expected.at("yfov_rad").get<double>()) > 1e-4)
        throw std::runtime_error("the camera is not as it was exported");
}

// The scene under one of its lights.
struct Lit {
    const Scene& scene;
    std::shared_ptr<const trace::World> world;
    Renderer& renderer;
};
void light_by(Scene& scene, const std::string& name) {
    int found = 0;
    ++scene.scene_rev;
    for (Light& light : scene.lights) {
        light.level_ratio = light.name == name ? 1.0 : 0.0;
        light.level_rev = scene.scene_rev;
        found += light.name == name;
    }
    if (found != 1) throw std::runtime_error("the light " + name + " was exported once, and is not here once");
}

// Straight at the point.
Scene looking_at(Scene scene, const Point& point) {
    scene.camera = {point.position + kEyeHeight_m * point.normal, point.position,
                    2.0 * std::atan(0.5 * kSeen_m / kEyeHeight_m)};
    return scene;
}

glm::dvec3 mean_of(const std::vector<float>& rgba) {
    glm::dvec3 sum(0.0);
    for (std::size_t i = 0; i + 3 < rgba.size(); i += 4) sum += glm::dvec3(rgba[i], rgba[i + 1], rgba[i + 2]);
    return sum / (static_cast<double>(rgba.size()) / 4.0);
}

glm::dvec3 by_reference(const Lit& lit, const Point& point) {
    trace::Settings settings;
    settings.bounces = point.quantity == "bounce_lx" ? 1 : 0;
    settings.noise = 0.002;
    if (point.quantity == "direct_nit") {
        settings.max_passes = 16;
        const Scene scene = looking_at(lit.scene, point);
        trace::Picture picture(lit.world, {scene.camera, 8, 8, trace::Quantity::radiance_direct, true}, settings);
        while (!picture.refine(1.0).complete) {
        }
        return mean_of(picture.values());
    }
    const trace::MeterPoint at[] = {{point.position, point.normal}};
    const trace::Reading reading = trace::measure(*lit.world, at, settings).front();
    return point.quantity == "bounce_lx" ? reading.indirect_lx : reading.direct_lx;
}

// A meter, or a picture of the point. Luminaires have no discs there.
std::optional<glm::dvec3> by_interactive(const Lit& lit, const Point& point) {
    if (point.quantity == "disc_lx") return std::nullopt;
    if (point.quantity == "direct_nit")
        return mean_of(lit.renderer.capture(looking_at(lit.scene, point), View::direct, 8, 8, true, 0, 1)->values);
    const bool bounce = point.quantity == "bounce_lx";
    const auto reading = lit.renderer.meter(lit.scene, point.position, point.normal,
                                            Renderer::MeterQuality::interactive, bounce ? 1 : 0);
    const auto& rgb = bounce ? reading.indirect_rgb_lx() : reading.direct_rgb_lx();
    return glm::dvec3(rgb.at(0), rgb.at(1), rgb.at(2));
}

// Result: the largest over the channels, relative; lux where nothing is expected; infinite where there is no number.
double difference(const Point& point, const glm::dvec3& value, const glm::dvec3& truth) {
    const glm::dvec3 whole = point.whole.value_or(truth);
    double largest = 0.0;
    for (int k = 0; k < 3; ++k) {
        const double here = std::abs(value[k] - truth[k]) / (whole[k] > 0.0 ? whole[k] : 1.0);
        largest = std::isfinite(here) ? std::max(largest, here) : std::numeric_limits<double>::infinity();
    }
    return largest;
}

void count(ExportRow& row, const Point& point, const Lit& lit) {
    const glm::dvec3 reference = by_reference(lit, point);
    ++row.points;
    if (!row.dark && !(point.cycles.r > 0.0)) throw std::runtime_error("\"" + row.group + "\" is dark in Cycles");
    for (int k = 0; k < 3; ++k) row.brightest = std::max(row.brightest, point.cycles[k]);
    row.cycles = std::max(row.cycles, difference(point, reference, point.cycles));
    if (point.closed_form) {
        row.has_closed_form = true;
        row.closed_form = std::max(row.closed_form, difference(point, reference, *point.closed_form));
    }
    if (const auto interactive = by_interactive(lit, point)) {
        row.has_interactive = true;
        row.interactive = std::max(row.interactive, difference(point, *interactive, point.cycles));
    }
}

std::string shown(bool present, bool dark, double value) {
    if (!present) return "";
    char text[32];
    std::snprintf(text, sizeof text, dark ? "%.2f lx" : "%.2f %%", dark ? value : 100.0 * value);
    return text;
}

}  // namespace

bool ExportRow::good() const {
    if (dark) return brightest + cycles + closed_form + interactive <= kExportDark_lx;
    return cycles <= kExportTolerance && interactive <= (quantity == "bounce_lx" ? kExportBounce : kExportTolerance) &&
           closed_form <= (quantity == "disc_lx" ? kExportPenumbra : kExportClosedForm);
}

std::vector<ExportRow> compare_export(const gl::Context& context, const std::string& directory) {
    std::ifstream file(directory + "/expected.json");
    if (!file) throw std::runtime_error("cannot read " + directory + "/expected.json");
    const auto expected = nlohmann::json::parse(file);
    const auto asset = load_scene(directory + "/room.glb");
    if (!asset) throw std::runtime_error(asset.error().text());
    check_camera(**asset, expected.at("camera"));
    Scene scene = scene_of(*asset);
    Renderer renderer(context);
    std::vector<ExportRow> rows;
    std::string light;
    Lit lit{scene, nullptr, renderer};
    for (const Point& point : points_of(expected)) {
        if (std::exchange(light, point.light) != point.light) {
            light_by(scene, light);
            lit.world = trace::make_world(scene, lit.world.get());
        }
        auto row = std::find_if(rows.begin(), rows.end(), [&](const ExportRow& r) { return r.group == point.group; });
        if (row == rows.end()) {
            row = rows.insert(rows.end(), {point.group, point.quantity});
            row->dark = point.group == "dark";
        }
        count(*row, point, lit);
    }
    return rows;
}

std::string export_markdown(const std::vector<ExportRow>& rows) {
    std::ostringstream out;
    out << "| points | | brightest | reference to Cycles | to the closed form | interactive to Cycles |\n"
           "|---|---|---|---|---|---|\n";
    for (const ExportRow& row : rows) {
        char text[64];
        std::snprintf(text, sizeof text, "%.1f %s", row.brightest, row.quantity == "direct_nit" ? "cd/m²" : "lx");
        out << "| " << row.group << " | " << row.points << " | " << text << " | " << shown(true, row.dark, row.cycles)
            << " | " << shown(row.has_closed_form, row.dark, row.closed_form) << " | "
            << shown(row.has_interactive, row.dark, row.interactive) << " |\n";
    }
    return out.str();
}

}  // namespace gonio::accuracy
