// glTF import of compressed meshes: each form of one mesh gives its triangles and its light.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "server/assets/draco_mesh.h"
#include "server/assets/gltf_expand.h"
#include "server/scene/apply.h"
#include "server/scene/scene.h"
#include "server/trace/reference.h"
#include "tests/fuzz/damaged.h"
#include "tests/scenes/encode_mesh.h"
#include "tests/unit/assets_gltf_fixture.h"

namespace gonio {
namespace {

using test::encode_draco;
using test::EncodedDraco;

// A plate of 2 x 2 m at 1 m, bumpy but for its rim, normals up.
Mesh plate() {
    constexpr int n = 16;
    Mesh mesh;
    for (int z = 0; z <= n; ++z) {
        for (int x = 0; x <= n; ++x) {
            const float u = static_cast<float>(x) / n, v = static_cast<float>(z) / n;
            const bool rim = x == 0 || z == 0 || x == n || z == n;
            const float bump = rim ? 0.0f : 0.1f * std::sin(9.0f * u) * std::cos(7.0f * v);
            mesh.vertices.push_back({{2 * u - 1, 1 + bump, 2 * v - 1}, {0, 1, 0}, {u, v}});
        }
    }
    for (std::uint32_t z = 0; z < n; ++z) {
        for (std::uint32_t x = 0; x < n; ++x) {
            const std::uint32_t a = z * (n + 1) + x, b = a + 1, c = a + n + 1, d = c + 1;
            mesh.indices.insert(mesh.indices.end(), {a, c, b, b, c, d});
        }
    }
    return mesh;
}

std::string bytes_of_positions(const Mesh& mesh) {
    std::vector<float> values;
    for (const Vertex& vertex : mesh.vertices)
        values.insert(values.end(), {vertex.position.x, vertex.position.y, vertex.position.z});
    return bytes_of(values);
}

Json accessor_without_bytes(int type, std::size_t count, const char* shape) {
    return {{"componentType", type}, {"count", count}, {"type", shape}};
}

// A point light of 1000 cd at 3 m over the plate's middle; the plate's accessors have no bytes yet: 0 positions, 1
// normals, 2 texture coordinates, 3 indices.
Json with_accessors(std::size_t points, std::size_t faces) {
    Json document = Json::parse(R"({"asset": {"version": "2.0"}, "scenes": [{"nodes": [0, 1]}],
        "nodes": [{"mesh": 0}, {"translation": [0, 3, 0], "extensions": {"KHR_lights_punctual": {"light": 0}}}],
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 1000}]}},
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}, "indices": 3}]}]})");
    document["accessors"] = {accessor_without_bytes(5126, points, "VEC3"), accessor_without_bytes(5126, points, "VEC3"),
                             accessor_without_bytes(5126, points, "VEC2"),
                             accessor_without_bytes(5123, 3 * faces, "SCALAR")};
    return document;
}

Json draco_document(const EncodedDraco& encoded) {
    Json document = with_accessors(encoded.points, encoded.faces);
    const int view = add_view(document, encoded.bytes);
    document["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"] = {
        {"bufferView", view}, {"attributes", {{"POSITION", 0}, {"NORMAL", 1}, {"TEXCOORD_0", 2}}}};
    document["extensionsUsed"] = document["extensionsRequired"] = {"KHR_draco_mesh_compression"};
    return document;
}

// The view holds `bytes`, compressed, of a buffer that is not there without.
int add_meshopt_view(Json& document, const std::string& bytes, const char* mode, std::size_t count, std::size_t stride,
                     const char* filter = "NONE") {
    document["buffers"].push_back(
        {{"byteLength", bytes.size()}, {"uri", "data:application/octet-stream;base64," + base64(bytes)}});
    const auto holder = document["buffers"].size() - 1;
    document["buffers"].push_back(
        {{"byteLength", count * stride}, {"extensions", {{"EXT_meshopt_compression", {{"fallback", true}}}}}});
    document["bufferViews"].push_back({{"buffer", holder + 1}, {"byteLength", count * stride}});
    Json& view = document["bufferViews"].back();
    if (std::string(mode) == "ATTRIBUTES") view["byteStride"] = stride;
    view["extensions"]["EXT_meshopt_compression"] = {{"buffer", holder},     {"byteLength", bytes.size()},
                                                     {"byteStride", stride}, {"count", count},
                                                     {"mode", mode},         {"filter", filter}};
    return static_cast<int>(document["bufferViews"].size()) - 1;
}

// The plate by meshopt: positions as floats, normals as octahedral bytes, texture coordinates as normalised shorts.
Json meshopt_document(bool sequence) {
    const Mesh mesh = plate();
    const std::size_t n = mesh.vertices.size();
    Json document = with_accessors(n, mesh.indices.size() / 3);
    Json& accessors = document["accessors"];
    accessors[0]["bufferView"] =
        add_meshopt_view(document, test::encode_meshopt_vertices(bytes_of_positions(mesh), n, 12), "ATTRIBUTES", n, 12);
    const std::string normals = test::filter_octahedral(std::vector<glm::vec3>(n, glm::vec3(0, 1, 0)));
    accessors[1]["bufferView"] =
        add_meshopt_view(document, test::encode_meshopt_vertices(normals, n, 4), "ATTRIBUTES", n, 4, "OCTAHEDRAL");
    accessors[1].update({{"componentType", 5120}, {"normalized", true}});
    std::string uvs;
    for (const Vertex& vertex : mesh.vertices) {
        for (int k = 0; k < 2; ++k) {
            const auto value = static_cast<unsigned>(std::lround(vertex.uv[k] * 65535.0f));
            uvs += {static_cast<char>(value & 255u), static_cast<char>(value >> 8)};
        }
    }
    accessors[2]["bufferView"] =
        add_meshopt_view(document, test::encode_meshopt_vertices(uvs, n, 4), "ATTRIBUTES", n, 4);
    accessors[2].update({{"componentType", 5123}, {"normalized", true}});
    const std::string indices =
        sequence ? test::encode_meshopt_sequence(mesh.indices, n) : test::encode_meshopt_triangles(mesh.indices, n);
    accessors[3]["bufferView"] =
        add_meshopt_view(document, indices, sequence ? "INDICES" : "TRIANGLES", mesh.indices.size(), 2);
    document["extensionsUsed"] = document["extensionsRequired"] = {"EXT_meshopt_compression", "KHR_mesh_quantization"};
    return document;
}

class AssetsCompressed : public GltfFixture {
protected:
    void refused(const Json& document, const std::string& code, const std::string& where) {
        const auto result = load(document);
        ASSERT_FALSE(result) << code << " at " << where;
        EXPECT_EQ(result.error().code, code) << result.error().text();
        EXPECT_EQ(result.error().where, where) << result.error().text();
        EXPECT_FALSE(result.error().message.empty());
    }
};

// Every triangle of the plate is among the mesh's, with corners in the same turn, each within `step` along each axis.
void expect_the_plate(const Mesh& mesh, double position_step, double uv_step) {
    const auto step = static_cast<float>(position_step), uv = static_cast<float>(uv_step);
    const Mesh plain = plate();
    ASSERT_EQ(mesh.indices.size(), plain.indices.size());
    const auto matches = [&](std::size_t a, std::size_t b) {
        for (std::size_t turn = 0; turn < 3; ++turn) {
            bool all = true;
            for (std::size_t k = 0; k < 3 && all; ++k) {
                const Vertex& p = plain.vertices[plain.indices[a + k]];
                const Vertex& q = mesh.vertices[mesh.indices[b + (k + turn) % 3]];
                for (int c = 0; c < 3; ++c) all &= std::abs(p.position[c] - q.position[c]) <= step;
                for (int c = 0; c < 2; ++c) all &= std::abs(p.uv[c] - q.uv[c]) <= uv;
                all &= glm::dot(p.normal, q.normal) > 0.9999f;
            }
            if (all) return true;
        }
        return false;
    };
    std::vector<bool> used(plain.indices.size());
    for (std::size_t a = 0; a < plain.indices.size(); a += 3) {
        std::size_t found = 0;
        while (found < mesh.indices.size() && (used[found] || !matches(a, found))) found += 3;
        ASSERT_LT(found, mesh.indices.size()) << "triangle " << a / 3;
        used[found] = true;
    }
}

// On the floor 3 m below the light the plate's shadow ends at 1.5 m: its rim is at 1 m, a metre above the floor.
// Beside it the light is I·h/d³.
void expect_its_light(const std::shared_ptr<const SceneAsset>& asset) {
    const auto world = trace::make_world(scene_of(asset));
    const trace::MeterPoint points[] = {{{0, 0, 0}, {0, 1, 0}},
                                        {{1.499, 0, 0.3}, {0, 1, 0}},
                                        {{1.501, 0, 0.3}, {0, 1, 0}},
                                        {{0.7, 0, -1.501}, {0, 1, 0}},
                                        {{2, 0, 2}, {0, 1, 0}}};
    trace::Settings settings;
    settings.bounces = 0;
    const auto readings = trace::measure(*world, points, settings);
    for (std::size_t i = 0; i < readings.size(); ++i) {
        const double d = glm::length(points[i].position - glm::dvec3(0, 3, 0));
        const double expected = i < 2 ? 0.0 : 1000.0 * 3.0 / (d * d * d);
        EXPECT_NEAR(readings[i].direct_lx.g, expected, 1e-5 * expected) << i;
    }
}

TEST_F(AssetsCompressed, DracoGivesTheSameTrianglesAndLight) {
    for (const bool sequential : {false, true}) {
        for (const int bits : {0, 14, 11}) {
            SCOPED_TRACE(std::to_string(bits) + (sequential ? " sequential" : " edgebreaker"));
            const auto scene = good(draco_document(encode_draco(plate(), bits, sequential)));
            ASSERT_EQ(scene->meshes.size(), 1u);
            // Half a step of the largest side, 2 m, and single precision.
            const double step = bits > 0 ? 1.0 / ((1 << bits) - 1) : 0.0;
            expect_the_plate(scene->meshes[0], step + 3e-7, 1e-6);
            expect_its_light(scene);
            ASSERT_EQ(scene->warnings.size(), 1u) << "--max-albedo of the default material alone";
        }
    }
}

TEST_F(AssetsCompressed, BytesOfAccessorsComeBeforeDraco) {
    Json document = draco_document(encode_draco(plate(), 14));
    Mesh mesh = plate();
    for (Vertex& vertex : mesh.vertices) vertex.position.y += 5;
    const int view = add_view(document, bytes_of_positions(mesh));
    document["accessors"][0]["bufferView"] = view;
    EXPECT_GT(good(document)->bounds.max.y, 5.5);
}

TEST_F(AssetsCompressed, ASmallerDracoMeshWarns) {
    const EncodedDraco encoded = encode_draco(plate(), 14);
    Json document = draco_document({encoded.bytes, encoded.points + 5, encoded.faces + 1});
    const auto scene = good(document);
    EXPECT_TRUE(warns(*scene, "smaller than its accessors"));
    expect_the_plate(scene->meshes.at(0), 1e-4, 1e-6);
}

// Encoders split vertices at seams, and some writers keep the counts from before.
TEST_F(AssetsCompressed, ALargerDracoMeshLoadsWhole) {
    const EncodedDraco encoded = encode_draco(plate(), 14);
    const auto scene = good(draco_document({encoded.bytes, encoded.points - 6, encoded.faces / 2}));
    EXPECT_TRUE(
        warns(*scene, "larger than its accessors say: it has 289 vertices for 283, 512 triangles for 256 (/meshes"));
    expect_the_plate(scene->meshes.at(0), 1e-4, 1e-6);
    expect_its_light(scene);
}

const std::string kDracoPlace = "/meshes/0/primitives/0/extensions/KHR_draco_mesh_compression";

TEST_F(AssetsCompressed, DracoRefusals) {
    const EncodedDraco encoded = encode_draco(plate(), 14);
    refused(draco_document({encoded.bytes, encoded.points / 4 - 1, encoded.faces}), "too_large", kDracoPlace);
    refused(draco_document({encoded.bytes, encoded.points, encoded.faces / 4 - 1}), "too_large", kDracoPlace);
    refused(draco_document({encoded.bytes, 2000000000, encoded.faces}), "too_large", kDracoPlace);
    refused(draco_document({encoded.bytes, encoded.points, 600000000}), "too_large", kDracoPlace);
    refused(draco_document({"DRACO", encoded.points, encoded.faces}), "bad_gltf", kDracoPlace);
    Json document = draco_document(encoded);
    Json& primitive = document["meshes"][0]["primitives"][0];
    Json& extension = primitive["extensions"]["KHR_draco_mesh_compression"];
    extension["attributes"]["NORMAL"] = 7;
    refused(document, "bad_gltf", kDracoPlace);
    extension["attributes"]["NORMAL"] = 2;  // two components
    refused(document, "bad_gltf", kDracoPlace);
    extension["attributes"]["NORMAL"] = -1;
    refused(document, "bad_gltf", kDracoPlace + "/attributes/NORMAL");
    extension["attributes"]["NORMAL"] = 1;
    extension["bufferView"] = 1;
    refused(document, "out_of_bounds", kDracoPlace + "/bufferView");
    extension["bufferView"] = 0;
    document["accessors"][1]["componentType"] = 5120;
    document["accessors"][0]["componentType"] = 5121;  // -1 m is no unsigned byte
    refused(document, "bad_gltf", kDracoPlace);
    primitive.erase("indices");
    refused(document, "bad_gltf", "/meshes/0/primitives/0");
}

std::string varint(std::uint32_t value) {
    std::string bytes;
    for (; value >= 128; value >>= 7) bytes += static_cast<char>(value | 128u);
    return bytes + static_cast<char>(value);
}

// Draco's header of version 2.2: triangles, 0 sequential or 1 Edgebreaker, no flags.
std::string draco_header(int method) {
    return std::string("DRACO\x02\x02\x01", 8) + static_cast<char>(method) + std::string(2, '\0');
}

// A few bytes that speak of gigabytes: nothing of it is allocated.
TEST_F(AssetsCompressed, DracoBombs) {
    const auto bomb = [&](const std::string& bytes, std::size_t points, std::size_t faces) {
        SCOPED_TRACE(base64(bytes.substr(0, 40)));
        refused(draco_document({bytes, points, faces}), "too_large", kDracoPlace);
    };
    constexpr std::uint32_t many = 1u << 24;
    const std::string edgebreaker = draco_header(1) + std::string(1, '\0');  // standard traversal
    // vertices, faces, sets of seams, symbols, splits
    bomb(edgebreaker + varint(many) + varint(0xffffffff / 3) + '\0' + varint(1) + varint(0), many, 4);
    bomb(edgebreaker + varint(0xffffffff) + varint(4) + '\0' + varint(1) + varint(0), many, 4);
    bomb(edgebreaker + varint(9) + varint(4) + '\0' + varint(4) + varint(0xffffffff), many, 4);
    bomb(edgebreaker + varint(9) + varint(many) + '\xff' + varint(4) + varint(0), many, many);  // 255 seams
    bomb(draco_header(0) + varint(4) + varint(0xffffffff), many, 4);
    // One face, then 200 attributes of 255 doubles for each of its points: 1.2 MB, and integers beside them.
    std::string wide = draco_header(0) + varint(1) + varint(3) + '\x01' + std::string("\0\1\2\1", 4) + varint(200);
    for (std::uint32_t i = 0; i < 200; ++i) wide += std::string("\x04\x0a\xff\x00", 4) + varint(i);
    wide += std::string(200, '\0') + std::string(200 * 255 * 8 * 3, '\0');
    const auto decoded = [&](std::size_t bytes) {
        return decode_draco(std::as_bytes(std::span(wide)), {}, {1, 3, bytes}, "/place");
    };
    ASSERT_FALSE(decoded(1 << 20));
    EXPECT_EQ(decoded(1 << 20).error().code, "too_large");
    const auto room = decoded(1 << 22);
    EXPECT_TRUE(room) << room.error().text();
}

TEST_F(AssetsCompressed, DamagedDracoAnswers) {
    const Mesh mesh = plate();
    std::mt19937 random(5);
    const DracoAttribute wanted[] = {{0, 5126, 3}, {1, 5126, 3}, {2, 5126, 2}};
    for (const bool sequential : {false, true}) {
        const EncodedDraco encoded = encode_draco(mesh, 12, sequential);
        const auto answers = [&](const std::string& bytes) {
            const auto result = decode_draco(std::as_bytes(std::span(bytes)), wanted,
                                             {encoded.faces, encoded.points, std::size_t{1} << 24}, "/place");
            if (!result) {
                EXPECT_EQ(result.error().where, "/place");
                EXPECT_TRUE(result.error().code == "bad_gltf" || result.error().code == "too_large");
                return;
            }
            EXPECT_LE(result->points, encoded.points);
            EXPECT_LE(result->indices.size(), 3 * encoded.faces);
            for (const std::uint32_t index : result->indices) ASSERT_LT(index, result->points);
            for (std::size_t k = 0; k < 3; ++k)
                EXPECT_EQ(result->attributes[k].size(), result->points * wanted[k].components * sizeof(float));
        };
        for (std::size_t size = 0; size < encoded.bytes.size(); size += 3) answers(encoded.bytes.substr(0, size));
        for (int i = 0; i < 1000; ++i) answers(fuzz::damaged(encoded.bytes, 1 + i % 3, random));
    }
}

TEST_F(AssetsCompressed, MeshoptGivesTheSameTrianglesAndLight) {
    for (const bool sequence : {false, true}) {
        SCOPED_TRACE(sequence ? "INDICES" : "TRIANGLES");
        const auto scene = good(meshopt_document(sequence));
        ASSERT_EQ(scene->meshes.size(), 1u);
        expect_the_plate(scene->meshes[0], 0.0, 0.5 / 65535 + 1e-7);
        expect_its_light(scene);
    }
}

// gltfpack's own buffer for what has no fallback has neither a uri nor a word that it is one.
TEST_F(AssetsCompressed, MeshoptBuffersWithoutBytes) {
    Json document = meshopt_document(false);
    for (Json& buffer : document["buffers"]) buffer.erase("extensions");
    const auto scene = good(document);
    expect_the_plate(scene->meshes.at(0), 0.0, 0.5 / 65535 + 1e-7);
    EXPECT_EQ(scene->warnings.size(), 1u) << "--max-albedo alone: nothing is left out";
    document["bufferViews"][0].erase("extensions");  // now it is the bytes that lack
    refused(document, "bad_gltf", "/buffers/1/uri");
}

TEST_F(AssetsCompressed, MeshoptExponentialFilter) {
    const Mesh mesh = plate();
    std::vector<glm::vec3> positions;
    for (const Vertex& vertex : mesh.vertices) positions.push_back(vertex.position);
    Json document = meshopt_document(false);
    const std::size_t n = positions.size();
    const int view =
        add_meshopt_view(document, test::encode_meshopt_vertices(test::filter_exponential(positions, 16), n, 12),
                         "ATTRIBUTES", n, 12, "EXPONENTIAL");
    document["accessors"][0]["bufferView"] = view;
    const auto scene = good(document);
    // Mantissas of 16 bits with their sign, of values up to 1.1: steps of 2^-14.
    expect_the_plate(scene->meshes.at(0), 1.0 / (1 << 14), 1e-5);
    expect_its_light(scene);
}

TEST_F(AssetsCompressed, MeshoptRefusals) {
    const std::string place = "/bufferViews/0/extensions/EXT_meshopt_compression";
    const auto changed = [](const char* member, const Json& value) {
        Json document = meshopt_document(false);
        document["bufferViews"][0]["extensions"]["EXT_meshopt_compression"][member] = value;
        return document;
    };
    refused(changed("count", 100), "bad_gltf", place + "/count");
    refused(changed("byteStride", 16), "bad_gltf", place + "/count");
    refused(changed("mode", "LINES"), "bad_gltf", place + "/mode");
    refused(changed("mode", "TRIANGLES"), "bad_gltf", place + "/byteStride");
    refused(changed("filter", "OCTAHEDRAL"), "bad_gltf", place + "/byteStride");
    refused(changed("filter", "WAVELET"), "bad_gltf", place + "/byteStride");
    refused(changed("byteLength", 20), "bad_gltf", place);
    refused(changed("byteLength", 2147483647), "out_of_bounds", place + "/byteLength");
    refused(changed("byteOffset", 2147483647), "out_of_bounds", place + "/byteLength");
    refused(changed("buffer", 1), "out_of_bounds", place + "/byteLength");  // a fallback has no bytes
    refused(changed("buffer", 99), "out_of_bounds", place + "/buffer");
    refused(changed("count", -1), "bad_gltf", place + "/count");
    Json document = meshopt_document(false);
    document["bufferViews"][0].erase("extensions");
    refused(document, "bad_gltf", "/bufferViews/0/buffer");
    document = meshopt_document(false);  // 90 million elements of 12 bytes from a few
    document["buffers"][1]["byteLength"] = document["bufferViews"][0]["byteLength"] = 90000000 * 12;
    document["bufferViews"][0]["extensions"]["EXT_meshopt_compression"]["count"] = 90000000;
    refused(document, "too_large", "/buffers/1/byteLength");
    document = meshopt_document(false);  // three views of the same bytes: zeros, 64 of each byte
    const std::size_t n = 1 << 16;
    const int zeros = add_meshopt_view(document, test::encode_meshopt_vertices(std::string(48 * n, '\0'), n, 48),
                                       "ATTRIBUTES", n, 48);
    for (int i = 0; i < 2; ++i) document["bufferViews"].push_back(document["bufferViews"][zeros]);
    ASSERT_TRUE(load(document));
    const auto bounded = load_scene(directory_ / "scene.gltf", "", {}, 8 << 20);
    ASSERT_FALSE(bounded);
    EXPECT_EQ(bounded.error().code, "too_large");
    EXPECT_EQ(bounded.error().where,
              "/bufferViews/" + std::to_string(zeros + 2) + "/extensions/EXT_meshopt_compression/count");
}

TEST_F(AssetsCompressed, DamagedMeshoptAnswers) {
    const Mesh mesh = plate();
    const std::size_t n = mesh.vertices.size();
    const struct {
        std::string bytes;
        const char *mode, *filter;
        std::size_t count, stride;
    } cases[] = {{test::encode_meshopt_vertices(bytes_of_positions(mesh), n, 12), "ATTRIBUTES", "EXPONENTIAL", n, 12},
                 {test::encode_meshopt_vertices(bytes_of_positions(mesh).substr(0, 8 * n), n, 8), "ATTRIBUTES",
                  "QUATERNION", n, 8},
                 {test::encode_meshopt_triangles(mesh.indices, n), "TRIANGLES", "NONE", mesh.indices.size(), 4},
                 {test::encode_meshopt_sequence(mesh.indices, n), "INDICES", "NONE", mesh.indices.size(), 2}};
    std::mt19937 random(6);
    for (const auto& c : cases) {
        for (int i = 0; i < 1000; ++i) {
            const std::string bytes = i == 0 ? c.bytes : fuzz::damaged(c.bytes, 1 + i % 3, random);
            const auto result =
                decode_meshopt(std::as_bytes(std::span(bytes)), c.mode, c.filter, c.count, c.stride, "/place");
            EXPECT_TRUE(i > 0 || result);
            if (result) {
                EXPECT_EQ(result->size(), c.count * c.stride);
            } else {
                EXPECT_EQ(result.error().code, "bad_gltf");
            }
        }
    }
}

// A morph target lifts the plate by half a metre and a joint lowers it again; the mesh's node is elsewhere. add: makes
// an accessor of so many bytes a vertex.
template <typename Add>
void pose_in_place(Json& document, std::size_t points, Add add) {
    std::vector<float> moves;
    std::string joints, weights;
    for (std::size_t i = 0; i < points; ++i) {
        moves.insert(moves.end(), {0.0f, 1.0f, 0.0f});
        joints += std::string(4, '\0');
        weights += std::string("\xff\0\0\0", 4);
    }
    Json& primitive = document["meshes"][0]["primitives"][0];
    primitive["targets"] = Json::array({Json{{"POSITION", add(bytes_of(moves), 5126, "VEC3", 12)}}});
    primitive["attributes"]["JOINTS_0"] = add(joints, 5121, "VEC4", 4);
    primitive["attributes"]["WEIGHTS_0"] = add(weights, 5121, "VEC4", 4);
    document["accessors"][primitive["attributes"]["WEIGHTS_0"].get<std::size_t>()]["normalized"] = true;
    document["nodes"][0].update({{"weights", {0.5}}, {"skin", 0}, {"translation", {50, 0, 0}}});
    document["nodes"].push_back({{"translation", {0, -0.5, 0}}});
    document["skins"] = Json::array({Json{{"joints", {2}}}});
}

TEST_F(AssetsCompressed, MorphTargetsAndSkinsOfDraco) {
    const EncodedDraco encoded = encode_draco(plate(), 0, true);
    Json document = draco_document(encoded);
    pose_in_place(document, encoded.points, [&](const std::string& bytes, int type, const char* shape, int) {
        return add_accessor(document, bytes, type, static_cast<int>(encoded.points), shape);
    });
    const auto scene = good(document);
    expect_its_light(scene);
    EXPECT_NEAR(scene->bounds.max.x, 1.0, 1e-6);
}

TEST_F(AssetsCompressed, MorphTargetsAndSkinsOfMeshopt) {
    Json document = meshopt_document(false);
    const std::size_t n = plate().vertices.size();
    pose_in_place(document, n, [&](const std::string& bytes, int type, const char* shape, std::size_t stride) {
        const int view =
            add_meshopt_view(document, test::encode_meshopt_vertices(bytes, n, stride), "ATTRIBUTES", n, stride);
        document["accessors"].push_back(accessor_without_bytes(type, n, shape));
        document["accessors"].back()["bufferView"] = view;
        return document["accessors"].size() - 1;
    });
    const auto scene = good(document);
    expect_its_light(scene);
    EXPECT_NEAR(scene->bounds.max.x, 1.0, 1e-6);
}

// KHR_mesh_quantization: positions as plain and normalised shorts and bytes, texture coordinates as plain shorts that
// KHR_texture_transform scales. A corner is at (100, -50, 20) steps.
TEST_F(AssetsCompressed, QuantisedAttributes) {
    const auto shorts = [](std::initializer_list<int> values, bool wide) {
        std::string bytes;
        for (const int value : values) {
            bytes += static_cast<char>(value & 255);
            if (wide) bytes += static_cast<char>(value >> 8 & 255);
        }
        return bytes;
    };
    for (const bool wide : {true, false}) {
        for (const bool normalised : {true, false}) {
            SCOPED_TRACE(std::to_string(wide) + std::to_string(normalised));
            Json document = triangle();
            // Elements are aligned to 4 bytes: the last of 4 is padding.
            const std::string positions = shorts({0, 0, 0, 0, 100, -50, 20, 0, 0, 100, 0, 0}, wide);
            const int accessor = add_accessor(document, positions, wide ? 5122 : 5120, 3, "VEC3", normalised);
            document["bufferViews"].back()["byteStride"] = wide ? 8 : 4;
            const std::string uvs = shorts({0, 0, 2048, 1024, 0, 0}, true);
            const int uv = add_accessor(document, uvs, 5123, 3, "VEC2");
            Json& attributes = document["meshes"][0]["primitives"][0]["attributes"];
            attributes = {{"POSITION", accessor}, {"TEXCOORD_0", uv}};
            document["meshes"][0]["primitives"][0]["material"] = 0;
            document["images"] = Json::array({Json{{"uri", "t.png"}}});
            write("t.png", *encode_png({1, 1, {1, 2, 3}}));
            document["textures"] = Json::parse(R"([{"source": 0}])");
            document["materials"] = Json::parse(R"([{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0,
                "extensions": {"KHR_texture_transform": {"scale": [0.000244140625, 0.000244140625]}}}}}])");
            document["extensionsUsed"] =
                document["extensionsRequired"] = {"KHR_mesh_quantization", "KHR_texture_transform"};
            const auto scene = good(document);
            const double step = !normalised ? 1.0 : wide ? 1.0 / 32767 : 1.0 / 127;  // glTF 2.0, 3.11
            const Vertex& corner = scene->meshes.at(0).vertices.at(1);
            EXPECT_NEAR(corner.position.x, 100 * step, 1e-7);
            EXPECT_NEAR(corner.position.y, -50 * step, 1e-7);
            EXPECT_NEAR(corner.position.z, 20 * step, 1e-7);
            EXPECT_EQ(corner.uv, glm::vec2(0.5f, 0.25f));
        }
    }
}

}  // namespace
}  // namespace gonio
