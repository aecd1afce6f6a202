// Inputs at the edge of what a file may hold: beams of a degree, webs with steps of no width, triangles and texture
// coordinates without area, normals of zero length, albedo 0 and 1, emitters like the sun.
#include <algorithm>

#include "ies/web.h"
#include "server/scene/scene.h"
#include "tests/stress/drive.h"

namespace gonio::stress {
namespace {

using Quality = Renderer::MeterQuality;
using ies::kPi;

// A web with I0 from the axis to half_rad, falling linearly to 0 over edge_rad.
std::shared_ptr<const Profile> pencil(double half_rad, double edge_rad) {
    auto profile = std::make_shared<Profile>();
    profile->name = "pencil";
    ies::PhotometricWeb& web = profile->photometry.web;
    web.v_rad = {0.0, half_rad, half_rad + edge_rad, kPi};
    web.h_rad = {0.0, 2 * kPi};
    for (int h = 0; h < 2; ++h) web.candela.insert(web.candela.end(), {1e5f, 1e5f, 0.0f, 0.0f});
    profile->peak_cd = ies::peak_intensity(web).in(cd);
    profile->flux_lm = ies::total_flux(web).in(lm);
    return profile;
}

Placed triangles(std::vector<Vertex> vertices, std::vector<std::uint32_t> indices, const Material& material) {
    Placed piece;
    piece.mesh.vertices = std::move(vertices);
    piece.mesh.indices = std::move(indices);
    piece.material = material;
    return piece;
}

// Triangles that cover nothing or next to nothing, around a point.
std::vector<Placed> slivers(const glm::vec3& p, const Material& material) {
    const glm::vec3 up(0, 1, 0), none(0, 0, 0);
    const auto at = [&](float x, float y, float z) { return p + glm::vec3(x, y, z); };
    return {
        triangles({{p, up, {}}, {p, up, {}}, {p, up, {}}}, {0, 1, 2}, material),                          // a point
        triangles({{p, up, {}}, {at(1, 0, 0), up, {}}, {p, up, {}}}, {0, 1, 2}, material),                // a line
        triangles({{p, up, {}}, {at(.5f, 0, 0), up, {}}, {at(1, 0, 0), up, {}}}, {0, 1, 2}, material),    // likewise
        triangles({{p, up, {}}, {at(1, 1e-7f, 0), up, {}}, {at(1, 0, 0), up, {}}}, {0, 1, 2}, material),  // a needle
        triangles({{p, none, {}}, {at(.05f, 0, 0), none, {}}, {at(0, 0, .05f), none, {}}}, {0, 1, 2}, material),
        triangles({{p, up, {}}, {at(1e-20f, 0, 0), up, {}}, {at(0, 0, 1e-20f), up, {}}}, {0, 1, 2}, material),
        triangles({{p, up, {}}, {at(1, 0, 0), up, {}}}, {0, 0, 1}, material),  // a repeated index
        triangles({}, {}, material)};
}

struct Ball {
    double radius = 2.0, rho = 0.5;
    std::vector<Placed> pieces() const {
        static const Mesh mesh = test::inward_sphere(2.0, 128);
        Placed piece;
        piece.mesh = mesh;
        piece.material = matte(rho);
        return {piece};
    }
    double bounced_lx(const Profile& profile) const { return rho * profile.flux_lm / (4 * kPi * radius * radius); }
};

// One bounce in the sphere against rho · flux / (4 pi R²), rsm quality, at four points.
void check_ball(Bench& bench, const Scene& scene, const Ball& ball, Finding& finding) {
    // None beside the spot of a beam, where the sum over all texels loses near light (case singularity).
    for (const glm::dvec3& along : {glm::dvec3{1, 0, 0}, {0, 1, 0}, {-0.6, 0.0, 0.8}, {-0.577, 0.577, 0.577}}) {
        const glm::dvec3 d = glm::normalize(along);
        const auto reading = read_meter(bench, scene, {d * ball.radius * 0.9998, -d}, Quality::rsm);
        const double truth = ball.bounced_lx(*scene.lights[0].profile);
        finding.note(std::abs(reading.indirect_lx() / truth - 1.0), [&] { return bench.context; });
    }
}

}  // namespace

void degenerate(Bench& bench) {
    BufferWatch watch(bench, "degenerate");
    const Meter floor_meter[] = {{{0, -2, 0}, {0, 1, 0}}};
    const Ball ball;

    Finding& beams = bench.findings.of(bench.group, "rsm: bounced error of narrow beams in a sphere", 0.01);
    const double degree = kPi / 180;
    struct Beam {
        const char* name;
        double half_rad, edge_rad;
    };
    for (const Beam& beam : {Beam{"0.5 degrees, edge 0.1", 0.5 * degree, 0.1 * degree},
                             {"5 degrees, hard edge", 5 * degree, 1e-6},
                             {"0.5 degrees, edge of no float width", 0.5 * degree, 1e-10}}) {
        for (const glm::dvec3& aim : {glm::dvec3{0, -1, 0}, {1, 1, 0}, {1, 1, 1}, {0.31, -0.77, 0.2}}) {
            if (bench.brief && aim.y != -1.0) continue;
            char text[96];
            std::snprintf(text, sizeof text, "beam of %s aimed %g,%g,%g", beam.name, aim.x, aim.y, aim.z);
            bench.context = text;
            Scene scene = scene_of_pieces(ball.pieces(), {light_seed(pencil(beam.half_rad, beam.edge_rad),
                                                                     {0.2, 0.1, 0}, orientation_aiming(aim))});
            check_ball(bench, scene, ball, beams);
            if (aim.x == 0.0 && (!bench.brief || beam.edge_rad == 1e-10)) drive(bench, scene, floor_meter);
        }
    }

    // As fine as two of the mask's texels, whose largest map has 1,024 a side.
    {
        bench.context = "beam of 0.1 degrees";
        Scene scene = scene_of_pieces(ball.pieces(), {light_seed(pencil(0.1 * degree, 0.02 * degree), {0.2, 0.1, 0},
                                                                 orientation_aiming({0, -1, 0}))});
        Finding& fine = bench.findings.of(bench.group, "a 0.1 degree beam's bounced error: rsm", 0.02);
        Finding& list = bench.findings.of(bench.group, "a 0.1 degree beam's bounced error: interactive", 0.02);
        const double truth = ball.bounced_lx(*scene.lights[0].profile);
        const Meter meter{{1.9996, 0, 0}, {-1, 0, 0}};
        const auto where = [&] { return bench.context; };
        const auto error = [&](Quality quality) {
            return std::abs(bench.renderer.meter(scene, meter.point, meter.normal, quality, 1).indirect_lx() / truth -
                            1.0);
        };
        bench.renderer.inspect_with({});  // the map's flux would count as a failure of every beam
        fine.note(error(Quality::rsm), where);
        list.note(error(Quality::interactive), where);
    }
    BufferWatch again(bench, "degenerate");

    // Triangles without area leave the light of the room as it is.
    Finding& kept = bench.findings.of(bench.group, "rsm: bounced error with degenerate triangles in a sphere", 0.005);
    const auto isotropic = test::isotropic(1000.0);
    {
        std::vector<Placed> pieces = ball.pieces();
        for (const glm::vec3& p : {glm::vec3(0, 0, 0), glm::vec3(-0.7f, 0.4f, 0.3f)}) {
            for (Placed& piece : slivers(p, matte(1.0))) pieces.push_back(std::move(piece));
        }
        Placed flat = ball.pieces()[0];  // a whole sphere flattened to nothing, and one to a plane in the luminaire
        flat.world_from_mesh = glm::dmat4(0.0);
        flat.world_from_mesh[3] = glm::dvec4(0.3, 0.3, 0.3, 1.0);
        pieces.push_back(flat);
        bench.context = "slivers and a mesh scaled to a point";
        Scene scene = scene_of_pieces(std::move(pieces), {light_seed(isotropic, {0.5, 0.3, 0.4})});
        scene.camera = {{0.5, 0.5, 1.5}, {0, 0, 0}, 1.0};
        check_ball(bench, scene, ball, kept);
        drive(bench, scene, floor_meter);
    }
    {
        std::vector<Placed> pieces = ball.pieces();
        Placed flat = ball.pieces()[0];
        flat.world_from_mesh = glm::dmat4(1.0);
        flat.world_from_mesh[1] = glm::dvec4(0.0);
        pieces.push_back(flat);
        bench.context = "a sphere flattened to a disc";
        Scene scene = scene_of_pieces(std::move(pieces), {light_seed(isotropic, {0.5, 0.3, 0.4})});
        drive(bench, scene, floor_meter);
    }

    // Textures on coordinates without area, with enormous and with negative ones.
    {
        Image image{4, 4, {}};
        for (int i = 0; i < 16; ++i)
            image.rgba.insert(image.rgba.end(), {255, static_cast<unsigned char>(17 * i), 0, 255});
        Material textured = matte(1.0);
        textured.base_color_image = 0;
        Material masked = textured;
        masked.alpha_mask = true;
        std::vector<Placed> pieces = ball.pieces();
        float y = -1.5f;
        for (const Material& material : {textured, masked}) {
            for (const glm::vec2& uv : {glm::vec2(0), glm::vec2(0.3f), glm::vec2(1e20f), glm::vec2(-1e6f)}) {
                Placed piece;
                piece.mesh = test::quad({-1, y, 1}, {1, y, 1}, {1, y, -1}, {-1, y, -1});
                for (Vertex& vertex : piece.mesh.vertices) vertex.uv = uv;
                piece.material = material;
                pieces.push_back(std::move(piece));
                y += 0.3f;
            }
        }
        bench.context = "texture coordinates without area";
        Scene scene = scene_of_pieces(std::move(pieces), {light_seed(isotropic, {0.5, 1.5, 0.4})}, {image});
        drive(bench, scene, floor_meter);
    }

    // Albedo 0 reflects nothing, albedo 1 everything.
    Finding& black = bench.findings.of(bench.group, "bounced lux off albedo 0", 0.0);
    Finding& white = bench.findings.of(bench.group, "rsm: bounced error at albedo 1 in a sphere", 0.005);
    for (double rho : {0.0, 1.0}) {
        bench.context = rho == 0.0 ? "albedo 0" : "albedo 1";
        const Ball extreme{2.0, rho};
        Scene scene = scene_of_pieces(extreme.pieces(), {light_seed(isotropic, {0.5, 0.3, 0.4})});
        if (rho > 0.0) {
            check_ball(bench, scene, extreme, white);
        } else {
            for (const Quality quality : {Quality::rsm, Quality::interactive}) {
                const double lux = read_meter(bench, scene, {{2, 0, 0}, {-1, 0, 0}}, quality).indirect_lx();
                black.note(lux, [&] { return bench.context; });
            }
        }
        if (!bench.brief) drive(bench, scene, floor_meter);
    }

    // Emitters from a screen to the sun's disc show their luminance, and light the sphere.
    Finding& shown = bench.findings.of(bench.group, "exr: error of an emitter's luminance", 0.005);
    for (double nits : {1e-3, 100.0, 1e5, 1.6e9}) {
        char text[64];
        std::snprintf(text, sizeof text, "emitter of %g cd/m2", nits);
        bench.context = text;
        std::vector<Placed> pieces = ball.pieces();
        Placed panel;
        panel.mesh = test::quad({-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1});
        panel.material = matte(0.0);
        panel.material.emissive_nit = glm::vec3(static_cast<float>(nits));
        pieces.push_back(panel);
        Scene scene = scene_of_pieces(std::move(pieces), {light_seed(isotropic, {0.5, 0.3, 0.4})});
        scene.camera = {{0, 0, 1}, {0, 0, -1}, 0.5};
        const std::vector<float> values = values_of(bench, scene, View::luminance, 5, 5);
        shown.note(std::abs(static_cast<double>(values[12 * 4]) / nits - 1.0), [&] { return bench.context; });
        if (!bench.brief || nits > 1e9) drive(bench, scene, floor_meter);
    }
}

}  // namespace gonio::stress
