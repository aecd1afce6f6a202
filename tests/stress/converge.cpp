// RSM resolutions 16 … 1024 in scenes of closed form: the texels are made here, by rays in double precision; the sum
// over them is the renderer's own.
#include <algorithm>

#include "ies/web.h"
#include "server/render/rsm_texels.h"
#include "shaders/lib/as_cpp.h"
#include "tests/stress/drive.h"

namespace gonio::stress {
namespace {

using ies::kPi;

struct Seen {
    double distance = 0.0;  // 0: nothing
    glm::dvec3 normal{0.0};
    double rho = 0.0;
};

// What a cube map of n² texels a face holds of a scene that is given as a ray query from the luminaire, isotropic, 1
// cd.
RsmTexels texels_of(int n, const std::function<Seen(const glm::dvec3&)>& look) {
    RsmTexels rsm;
    rsm.size = n;
    for (int face = 0; face < 6; ++face) {
        for (int j = 0; j < n; ++j) {
            for (int i = 0; i < n; ++i) {
                const glm::dvec2 st((2.0 * i + 1.0) / n - 1.0, (2.0 * j + 1.0) / n - 1.0);
                const glm::dvec3 d = glm::normalize(glsl64::cube_direction(face, st));
                const Seen seen = look(d);
                const glm::dvec2 code = seen.distance > 0.0 ? glsl64::octahedral_encode(seen.normal) : glm::dvec2(0);
                rsm.radial_depth.push_back(static_cast<float>(seen.distance));
                for (int k = 0; k < 2; ++k)
                    rsm.normal.push_back(static_cast<std::int16_t>(std::lround(code[k] * 32767.0)));
                const double solid_angle = glsl64::cube_texel_solid_angle(i, j, n);
                const double area = glsl64::texel_area(solid_angle, seen.distance,
                                                       seen.distance > 0.0 ? -glm::dot(seen.normal, d) : 1.0);
                rsm.flux.emplace_back(glm::vec3(static_cast<float>(seen.rho * solid_angle)),
                                      static_cast<float>(area / kPi));
            }
        }
    }
    return rsm;
}

Seen look_at_sphere(const glm::dvec3& light, double radius, const glm::dvec3& d) {
    const double b = glm::dot(d, light), c = glm::dot(light, light) - radius * radius;
    const double t = -b + std::sqrt(b * b - c);
    return {t, -glm::normalize(light + d * t), 0.5};
}

// A wall z = 0 without end, seen from one metre before it.
Seen look_at_wall(const glm::dvec3& d) {
    return d.z < 0.0 ? Seen{-1.0 / d.z, {0, 0, 1}, 0.5} : Seen{};
}

// Result: illuminance at (x, 0, gap) facing the wall of look_at_wall, 1 cd at (0, 0, 1): rho/pi ∫ cos/d² · cos cos /
// d⁴, by 1500 × 1500 midpoints in polar coordinates around the receiver's foot, radius gap · sinh(t): good to 1e-6.
double before_wall(double x, double gap) {
    constexpr int kRadii = 1500, kTurns = 1500;
    const double last = std::asinh(2000.0 / gap);
    double sum = 0.0;
    for (int i = 0; i < kRadii; ++i) {
        const double t = (i + 0.5) * last / kRadii, r = gap * std::sinh(t), dr = gap * std::cosh(t) * last / kRadii;
        const double d2 = gap * gap + r * r, factor = gap * gap / (d2 * d2) * r * dr;
        for (int k = 0; k < kTurns; ++k) {
            const double qx = x + r * std::cos(2 * kPi * (k + 0.5) / kTurns),
                         qy = r * std::sin(2 * kPi * (k + 0.5) / kTurns);
            sum += factor * std::pow(qx * qx + qy * qy + 1.0, -1.5) * (2 * kPi / kTurns);
        }
    }
    return 0.5 / kPi * sum;
}

}  // namespace

void convergence(Bench& bench) {
    const std::vector<int> sizes =
        bench.brief ? std::vector<int>{32, 128, 512} : std::vector<int>{16, 32, 64, 128, 256, 512, 1024};
    struct Point {
        const char* name;
        glm::dvec3 at, normal;
        double truth;
    };
    struct Room {
        const char* name;
        std::function<Seen(const glm::dvec3&)> look;
        std::vector<Point> points;  // relative to the luminaire
    };
    const glm::dvec3 inside(0.5, 0.3, 0.4);
    const double in_sphere = 0.5 * 4 * kPi / (4 * kPi * 4.0);
    std::vector<Room> rooms;
    rooms.push_back({"sphere", [&](const glm::dvec3& d) { return look_at_sphere(inside, 2.0, d); }, {}});
    for (const glm::dvec3& along : {glm::dvec3{1, 0, 0}, {0, -1, 0}, {-0.6, 0.0, 0.8}, {0.577, -0.577, 0.577}}) {
        const glm::dvec3 d = glm::normalize(along);
        rooms[0].points.push_back({"", d * 2.0 - inside, -d, in_sphere});
    }
    rooms.push_back({"wall, 1 m away", look_at_wall, {}});
    rooms.push_back({"wall, 10 cm away", look_at_wall, {}});
    for (double x : {0.0, 0.37, 1.1}) {
        rooms[1].points.push_back({"", glm::dvec3(x, 0, 0.0), {0, 0, -1}, before_wall(x, 1.0)});
        rooms[2].points.push_back({"", glm::dvec3(x, 0, -0.9), {0, 0, -1}, before_wall(x, 0.1)});
    }
    for (Room& room : rooms) {
        // Root mean square over the points, so that an error that changes sign does not pass for a small one.
        Finding& last = bench.findings.of("convergence", std::string(room.name) + ": error at 512", 0.002);
        std::vector<double> errors;
        for (int n : sizes) {
            const RsmTexels rsm = texels_of(n, room.look);
            double squares = 0.0;
            for (const Point& point : room.points) {
                const auto halves = checkerboard_irradiance(rsm, point.at, point.normal);
                const double e = (halves[0] + halves[1]).g / point.truth - 1.0;
                squares += e * e / static_cast<double>(room.points.size());
            }
            errors.push_back(std::sqrt(squares));
            last.profile.emplace_back(std::to_string(n), errors.back());
            if (n == 512) last.note(errors.back(), [&] { return std::string("512"); });
        }
        const auto error_at = [&](int n) {
            return errors[static_cast<std::size_t>(std::find(sizes.begin(), sizes.end(), n) - sizes.begin())];
        };
        const double order = std::log2(error_at(32) / error_at(512)) / 4.0;
        // Written as a shortfall, so that less is better as everywhere else.
        bench.findings.of("convergence", std::string(room.name) + ": 0.8 - observed order, 32 to 512", 0.0)
            .note(std::max(0.0, 0.8 - order), [&] { return "order " + std::to_string(order); });
        last.profile.emplace_back("order", order);
    }
}

}  // namespace gonio::stress
