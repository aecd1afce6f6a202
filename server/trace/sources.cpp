#include "server/trace/sources.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "server/scene/apply.h"

namespace gonio::trace {
namespace {

constexpr int kPolar = DirectionTable::kPolar, kAzimuth = DirectionTable::kAzimuth;
constexpr double kPolarStep = std::numbers::pi / kPolar, kAzimuthStep = 2.0 * std::numbers::pi / kAzimuth;

// Result: the cell of running sums that x falls into.
template <typename It>
std::size_t cell_of(It begin, It end, double x) {
    const auto above = std::upper_bound(begin, end, x);
    const auto cells = static_cast<std::size_t>(end - begin) - 1;
    const auto cell = static_cast<std::size_t>(std::max<std::ptrdiff_t>(0, above - begin - 1));
    return std::min(cell, cells - 1);
}

// Direction with polar angle from -Z and azimuth from +X towards +Y: LM-63's Type C angles.
glm::dvec3 direction_at(double cos_polar, double azimuth) {
    const double sine = std::sqrt(std::max(0.0, 1.0 - cos_polar * cos_polar));
    return {sine * std::cos(azimuth), sine * std::sin(azimuth), -cos_polar};
}

// polar, azimuth: those of direction_at, rad. Type C webs have the same angles.
LuminousIntensity intensity_in(const ies::PhotometricWeb& web, double polar, double azimuth) {
    if (web.goniometer == ies::Goniometer::type_c)
        return ies::intensity_at(web, Angle::radians(polar), Angle::radians(azimuth));
    const glm::dvec3 d = direction_at(std::cos(polar), azimuth);
    return ies::intensity(web, {d.x, d.y, d.z});
}

// Result: the cell of a direction in the luminaire frame: polar × kAzimuth + azimuth.
std::size_t cell_at(const glm::dvec3& d) {
    const double polar = std::atan2(std::sqrt(d.x * d.x + d.y * d.y), -d.z);
    double azimuth = std::atan2(d.y, d.x);
    if (azimuth < 0.0) azimuth += 2.0 * std::numbers::pi;
    const int v = std::clamp(static_cast<int>(polar / kPolarStep), 0, kPolar - 1);
    const int h = std::clamp(static_cast<int>(azimuth / kAzimuthStep), 0, kAzimuth - 1);
    return static_cast<std::size_t>(v) * kAzimuth + static_cast<std::size_t>(h);
}

}  // namespace

DirectionTable::DirectionTable(std::shared_ptr<const Profile> profile) : profile_(std::move(profile)) {
    const ies::PhotometricWeb& web = profile_->photometry.web;
    // Intensities at twice the table's resolution: corners, edge middles and centres of the cells.
    const int nodes_h = 2 * kAzimuth, nodes_v = 2 * kPolar + 1;
    std::vector<float> node(static_cast<std::size_t>(nodes_h) * static_cast<std::size_t>(nodes_v));
    const auto at = [&](int v, int h) -> float& {
        return node[static_cast<std::size_t>(v) * static_cast<std::size_t>(nodes_h) +
                    static_cast<std::size_t>(h % nodes_h)];
    };
    for (int v = 0; v < nodes_v; ++v) {
        for (int h = 0; h < nodes_h; ++h) {
            at(v, h) = static_cast<float>(intensity_in(web, 0.5 * v * kPolarStep, 0.5 * h * kAzimuthStep).in(cd));
        }
    }
    // The largest intensity that is seen in each cell: on its nodes, and on the web's own angles that cross it. Between
    // those a web is linear, so that no cell with light in it is left without.
    std::vector<float> cell(static_cast<std::size_t>(kPolar) * kAzimuth);
    for (int v = 0; v < kPolar; ++v) {
        for (int h = 0; h < kAzimuth; ++h) {
            float& greatest = cell[static_cast<std::size_t>(v) * kAzimuth + static_cast<std::size_t>(h)];
            for (int i = 0; i <= 2; ++i) {
                for (int j = 0; j <= 2; ++j) greatest = std::max(greatest, at(2 * v + i, 2 * h + j));
            }
        }
    }
    const auto raise = [&](double v, double h, float candela) {
        if (!(candela > 0.0f)) return;
        const ies::Direction d = ies::direction_of(web.goniometer, Angle::radians(v), Angle::radians(h));
        float& greatest = cell[cell_at({d[0], d[1], d[2]})];
        greatest = std::max(greatest, candela);
    };
    // Along an edge of the web's grid in steps of a quarter of a degree.
    const auto walk = [&](double v0, double h0, float c0, double v1, double h1, float c1) {
        if (!(c0 > 0.0f) && !(c1 > 0.0f)) return;
        const int steps = 1 + static_cast<int>(std::max(std::abs(v1 - v0), std::abs(h1 - h0)) / (0.5 * kPolarStep));
        for (int i = 0; i <= steps; ++i) {
            const double t = static_cast<double>(i) / steps;
            raise(std::lerp(v0, v1, t), std::lerp(h0, h1, t),
                  static_cast<float>(std::lerp(static_cast<double>(c0), static_cast<double>(c1), t)));
        }
    };
    for (std::size_t h = 0; h < web.h_rad.size(); ++h) {
        for (std::size_t v = 0; v < web.v_rad.size(); ++v) {
            if (v + 1 < web.v_rad.size())
                walk(web.v_rad[v], web.h_rad[h], web.at(h, v), web.v_rad[v + 1], web.h_rad[h], web.at(h, v + 1));
            if (h + 1 < web.h_rad.size())
                walk(web.v_rad[v], web.h_rad[h], web.at(h, v), web.v_rad[v], web.h_rad[h + 1], web.at(h + 1, v));
        }
    }

    rows_.push_back(0.0);
    columns_.reserve(static_cast<std::size_t>(kPolar) * (kAzimuth + 1));
    for (int v = 0; v < kPolar; ++v) {
        const double solid_angle = (std::cos(v * kPolarStep) - std::cos((v + 1) * kPolarStep)) * kAzimuthStep;
        double row = 0.0;
        const std::size_t first = columns_.size();
        columns_.push_back(0.0f);
        for (int h = 0; h < kAzimuth; ++h) {
            row += static_cast<double>(cell[static_cast<std::size_t>(v) * kAzimuth + static_cast<std::size_t>(h)]);
            columns_.push_back(static_cast<float>(row));
        }
        for (std::size_t h = first; h < columns_.size(); ++h) {
            columns_[h] = row > 0.0 ? static_cast<float>(static_cast<double>(columns_[h]) / row)
                                    : static_cast<float>(h - first) / kAzimuth;
        }
        total_ += row * solid_angle;
        rows_.push_back(total_);
    }
    // draw() takes a row by its share of the total and a cell by its share of the row; with the row's share the same
    // as the sum of its cells times their solid angle, the density is the cell's intensity over the total.
    densities_ = std::move(cell);
    for (float& density : densities_)
        density = total_ > 0.0 ? static_cast<float>(static_cast<double>(density) / total_) : 0.0f;
}

glm::dvec3 DirectionTable::draw(glm::vec2 random, double& density) const {
    const double x = static_cast<double>(random.x) * total_;
    const std::size_t v = cell_of(rows_.begin(), rows_.end(), x);
    const double row = rows_[v + 1] - rows_[v];
    const double across = row > 0.0 ? std::clamp((x - rows_[v]) / row, 0.0, 1.0) : 0.5;
    const auto columns = columns_.begin() + static_cast<std::ptrdiff_t>(v * (kAzimuth + 1));
    const std::size_t h = cell_of(columns, columns + kAzimuth + 1, static_cast<double>(random.y));
    const double cell =
        static_cast<double>(columns[static_cast<std::ptrdiff_t>(h) + 1] - columns[static_cast<std::ptrdiff_t>(h)]);
    const double along =
        cell > 0.0
            ? std::clamp(
                  (static_cast<double>(random.y) - static_cast<double>(columns[static_cast<std::ptrdiff_t>(h)])) / cell,
                  0.0, 1.0)
            : 0.5;
    const double top = std::cos(static_cast<double>(v) * kPolarStep),
                 bottom = std::cos(static_cast<double>(v + 1) * kPolarStep);
    density = row * cell / total_ / ((top - bottom) * kAzimuthStep);
    return direction_at(top + (bottom - top) * across, (static_cast<double>(h) + along) * kAzimuthStep);
}

double DirectionTable::density(const glm::dvec3& d) const {
    return static_cast<double>(densities_[cell_at(d)]);
}

glm::dvec3 Luminaire::point(glm::vec2 random, glm::vec2 more) const {
    const double x = opening.length.in(m), y = opening.width.in(m), z = opening.height.in(m);
    const double a = static_cast<double>(random.x) - 0.5, b = static_cast<double>(random.y) - 0.5;
    const double turn = 2.0 * std::numbers::pi * static_cast<double>(random.y),
                 root = 0.5 * std::sqrt(static_cast<double>(random.x));
    const double c = static_cast<double>(more.x) - 0.5;
    glm::dvec3 p(0.0);
    using Shape = ies::OpeningShape;
    switch (opening.shape) {
        case Shape::point:
            break;
        case Shape::rectangle:
            p = {a * x, b * y, 0.0};
            break;
        case Shape::box: {  // bottom and the four sides, by area
            const double areas[] = {x * y, x * z, x * z, y * z, y * z};
            double pick = static_cast<double>(more.x) * (areas[0] + 2.0 * areas[1] + 2.0 * areas[3]);
            int face = 0;
            while (face < 4 && pick > areas[face]) pick -= areas[face++];
            p = face == 0   ? glm::dvec3(a * x, b * y, -0.5 * z)
                : face <= 2 ? glm::dvec3(a * x, face == 1 ? 0.5 * y : -0.5 * y, b * z)
                            : glm::dvec3(face == 3 ? 0.5 * x : -0.5 * x, a * y, b * z);
            break;
        }
        case Shape::ellipse:
            p = {root * x * std::cos(turn), root * y * std::sin(turn), 0.0};
            break;
        case Shape::vertical_cylinder:
            p = {0.5 * x * std::cos(turn), 0.5 * y * std::sin(turn), c * z};
            break;
        case Shape::ellipsoid: {
            const double height = 1.0 - 2.0 * static_cast<double>(random.x),
                         radius = std::sqrt(std::max(0.0, 1.0 - height * height));
            p = 0.5 * glm::dvec3(x * radius * std::cos(turn), y * radius * std::sin(turn), z * height);
            break;
        }
        case Shape::horizontal_cylinder_length:
            p = {c * x, 0.5 * y * std::cos(turn), 0.5 * z * std::sin(turn)};
            break;
        case Shape::horizontal_cylinder_width:
            p = {0.5 * x * std::cos(turn), c * y, 0.5 * z * std::sin(turn)};
            break;
        case Shape::vertical_ellipse:
            p = {0.0, root * y * std::cos(turn), root * z * std::sin(turn)};
            break;
    }
    return position + world_from_light * p;
}

double Luminaire::intensity_cd(const glm::dvec3& direction) const {
    const glm::dvec3 d = glm::transpose(world_from_light) * direction;
    return ies::intensity(profile().photometry.web, {d.x, d.y, d.z}).in(cd);
}

std::vector<Luminaire> luminaires_of(const Scene& scene, const Geometry& geometry,
                                     const std::vector<Luminaire>& known) {
    std::vector<Luminaire> result;
    for (const Light& light : scene.lights) {
        Luminaire luminaire;
        luminaire.position = light.position - geometry.origin();
        luminaire.world_from_light = glm::mat3_cast(light.world_from_light);
        luminaire.weight = glm::vec3(light_weight(scene, light));
        luminaire.opening = light.profile->photometry.opening;
        luminaire.opening_radius_m =
            0.5 * glm::length(glm::dvec3(luminaire.opening.length.in(m), luminaire.opening.width.in(m),
                                         luminaire.opening.height.in(m)));
        luminaire.power = static_cast<float>(luminance(glm::dvec3(luminaire.weight)) * light.profile->flux_lm);
        if (!(luminaire.power > 0.0f)) continue;
        const auto shares = [&](const Luminaire& other) { return other.table->profile() == light.profile; };
        auto same = std::find_if(result.begin(), result.end(), shares);
        if (same == result.end()) {
            const auto before = std::find_if(known.begin(), known.end(), shares);
            luminaire.table =
                before != known.end() ? before->table : std::make_shared<const DirectionTable>(light.profile);
        } else {
            luminaire.table = same->table;
        }
        if (!luminaire.table->dark()) result.push_back(std::move(luminaire));
    }
    return result;
}

Emitters emitters_of(const Geometry& geometry) {
    const SceneAsset& asset = geometry.asset();
    Emitters emitters;
    emitters.running.push_back(0.0);
    emitters.first_of_instance.assign(asset.instances.size(), -1);
    for (std::size_t i = 0; i < asset.instances.size(); ++i) {
        const Mesh& mesh = asset.meshes[static_cast<std::size_t>(asset.instances[i].mesh)];
        const Material& material = asset.materials[static_cast<std::size_t>(mesh.material)];
        if (material.emissive_nit == glm::vec3(0.0f)) continue;
        emitters.first_of_instance[i] = static_cast<int>(emitters.list.size());
        for (int triangle = 0; triangle < static_cast<int>(mesh.indices.size() / 3); ++triangle) {
            Emitter emitter;
            emitter.instance = static_cast<int>(i);
            emitter.triangle = triangle;
            emitter.corner = geometry.corners(emitter.instance, triangle);
            const glm::dvec3 cross = glm::cross(glm::dvec3(emitter.corner[1] - emitter.corner[0]),
                                                glm::dvec3(emitter.corner[2] - emitter.corner[0]));
            const double twice = glm::length(cross);
            emitter.area_m2 = static_cast<float>(0.5 * twice);
            if (twice > 0.0) emitter.normal = glm::vec3(cross / twice);
            emitter.double_sided = material.double_sided;
            // A textured emitter is chosen by the mean of its corners, middle and edges, and now and then where they
            // are all dark.
            glm::dvec3 sum(0.0);
            for (const glm::vec2 uv :
                 {glm::vec2(0, 0), {1, 0}, {0, 1}, {0.5, 0}, {0, 0.5}, {0.5, 0.5}, {1 / 3.0, 1 / 3.0}}) {
                sum += glm::dvec3(geometry.emission_at(emitter.instance, triangle, uv.x, uv.y)) / 7.0;
            }
            const double power = (luminance(sum) + 0.01 * luminance(glm::dvec3(material.emissive_nit))) * 0.5 * twice;
            emitters.list.push_back(emitter);
            emitters.running.push_back(emitters.running.back() + (std::isfinite(power) ? power : 0.0));
        }
    }
    if (!(emitters.running.back() > 0.0)) return {{}, {0.0}, std::vector<int>(asset.instances.size(), -1)};
    return emitters;
}

}  // namespace gonio::trace
