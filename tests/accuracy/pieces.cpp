#include "tests/accuracy/pieces.h"

#include <cmath>
#include <utility>

#include "ies/web.h"
#include "server/scene/scene.h"

namespace gonio::accuracy {
namespace {

using ies::kPi;

// Nodes and weights on 0..1, by Newton's method on the Legendre polynomial P_n.
std::vector<std::pair<double, double>> gauss_legendre(int n) {
    std::vector<std::pair<double, double>> result;
    for (int i = 0; i < n; ++i) {
        double x = std::cos(kPi * (i + 0.75) / (n + 0.5)), slope = 1.0;
        for (int step = 0; step < 50; ++step) {
            double p0 = 1.0, p1 = x;
            for (int k = 2; k <= n; ++k) p0 = std::exchange(p1, ((2 * k - 1) * x * p1 - (k - 1) * p0) / k);
            slope = n * (x * p1 - p0) / (x * x - 1);
            x -= p1 / slope;
        }
        result.emplace_back((1 - x) / 2, 1 / ((1 - x * x) * slope * slope));
    }
    return result;
}

}  // namespace

test::Piece wall(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, const glm::dvec3& d,
                 float reflectance) {
    return {test::quad(a, b, c, d), glm::vec3(reflectance)};
}

std::vector<Face> room_faces(double x, double y, double z) {
    return {{"floor", cie(0, 0, 0), cie(x, 0, 0), cie(0, y, 0), cie(0, 0, 1)},
            {"ceiling", cie(0, 0, z), cie(0, y, 0), cie(x, 0, 0), cie(0, 0, -1)},
            {"wall y = 0", cie(0, 0, 0), cie(0, 0, z), cie(x, 0, 0), cie(0, 1, 0)},
            {"wall y = max", cie(0, y, 0), cie(x, 0, 0), cie(0, 0, z), cie(0, -1, 0)},
            {"wall x = 0", cie(0, 0, 0), cie(0, y, 0), cie(0, 0, z), cie(1, 0, 0)},
            {"wall x = max", cie(x, 0, 0), cie(0, 0, z), cie(0, y, 0), cie(-1, 0, 0)}};
}

std::vector<test::Piece> room(double x, double y, double z, float reflectance) {
    std::vector<test::Piece> pieces;
    for (const Face& f : room_faces(x, y, z))
        pieces.push_back(wall(f.corner, f.corner + f.u, f.corner + f.u + f.v, f.corner + f.v, reflectance));
    return pieces;
}

std::vector<test::Piece> block(const glm::dvec3& low, const glm::dvec3& high, float reflectance) {
    const glm::dvec3 s = high - low;
    std::vector<test::Piece> pieces;
    const glm::dvec3 shift = cie(low.x, low.y, low.z);
    for (const Face& f : room_faces(s.x, s.y, s.z)) {  // turned inside out
        const glm::dvec3 corner = f.corner + shift;
        pieces.push_back(wall(corner, corner + f.v, corner + f.u + f.v, corner + f.u, reflectance));
    }
    return pieces;
}

std::shared_ptr<const Profile> axial_profile(const std::string& name, double step_deg,
                                             const std::function<double(double)>& law) {
    auto profile = std::make_shared<Profile>();
    profile->name = name;
    ies::PhotometricWeb& web = profile->photometry.web;
    const int n = static_cast<int>(std::lround(180.0 / step_deg));
    for (int i = 0; i <= n; ++i) web.v_rad.push_back(kPi * i / n);
    web.h_rad = {0.0, 2 * kPi};
    for (int plane = 0; plane < 2; ++plane) {
        for (double v : web.v_rad) web.candela.push_back(static_cast<float>(law(v)));
    }
    profile->peak_cd = ies::peak_intensity(web).in(cd);
    profile->flux_lm = ies::total_flux(web).in(lm);
    return profile;
}

std::shared_ptr<const Profile> even_light(double lux, double h, double edge_rad) {
    return axial_profile("even light", 0.05, [=](double theta) {
        return theta < edge_rad ? lux * h * h / std::pow(std::cos(theta), 3.0) : 0.0;
    });
}

std::shared_ptr<const Profile> with_opening(const Profile& profile, const ies::Opening& opening) {
    auto result = std::make_shared<Profile>(profile);
    result->photometry.opening = opening;
    return result;
}

Scene unlit_scene(std::vector<test::Piece> pieces) {
    Scene scene = test::scene_with(std::move(pieces), test::isotropic(0.0), glm::dvec3(0.0));
    scene.lights.clear();
    return scene;
}

std::vector<Sample> quadrature(const glm::dvec3& corner, const glm::dvec3& u, const glm::dvec3& v,
                               const glm::dvec3& normal, int n, double total) {
    std::vector<Sample> samples;
    const auto nodes = gauss_legendre(n);
    for (const auto& [s, ws] : nodes) {
        for (const auto& [t, wt] : nodes) samples.push_back({corner + s * u + t * v, normal, total * ws * wt});
    }
    return samples;
}

}  // namespace gonio::accuracy
