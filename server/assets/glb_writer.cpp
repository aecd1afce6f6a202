#include "server/assets/glb_writer.h"

#include <cmath>

#include "server/assets/glb_chunks.h"

namespace gonio {
namespace {

// glTF 2.0, 4.4.2: the header of a .glb.
constexpr std::uint32_t kMagic = 0x46546C67, kVersion = 2;

// 5.26: wrapping.
int wrapping(Wrap wrap) {
    return wrap == Wrap::clamp ? 33071 : wrap == Wrap::repeat ? 10497 : 33648;
}

}  // namespace

GlbWriter::GlbWriter() {
    document["asset"] = {{"version", "2.0"}, {"generator", "gonio"}};
    document["scene"] = 0;
}

std::size_t GlbWriter::add(const char* list, Json element) {
    document[list].push_back(std::move(element));
    return document[list].size() - 1;
}

std::size_t GlbWriter::add_view(const void* bytes, std::size_t size) {
    const std::size_t view = add("bufferViews", {{"buffer", 0}, {"byteOffset", binary_.size()}, {"byteLength", size}});
    binary_.append(static_cast<const char*>(bytes), size);
    binary_.resize((binary_.size() + 3) / 4 * 4, '\0');
    return view;
}

std::size_t GlbWriter::add_accessor(std::size_t view, std::size_t count, int component_type, const char* type,
                                    const Json& more) {
    Json accessor = {{"bufferView", view}, {"componentType", component_type}, {"count", count}, {"type", type}};
    if (!more.is_null()) accessor.update(more);
    return add("accessors", std::move(accessor));
}

std::size_t GlbWriter::add_positions(const std::vector<glm::vec3>& positions) {
    glm::vec3 low(1e30f), high(-1e30f);
    for (const glm::vec3& p : positions) low = glm::min(low, p), high = glm::max(high, p);
    return add_accessor(positions, kFloat, "VEC3", {{"min", {low.x, low.y, low.z}}, {"max", {high.x, high.y, high.z}}});
}

std::size_t GlbWriter::add_image(std::span<const std::byte> png) {
    const std::size_t view = add_view(png.data(), png.size());
    return add("images", {{"mimeType", "image/png"}, {"bufferView", view}});
}

std::size_t GlbWriter::add_texture(std::size_t image, Wrap wrap_s, Wrap wrap_t) {
    const std::size_t sampler = add("samplers", {{"wrapS", wrapping(wrap_s)}, {"wrapT", wrapping(wrap_t)}});
    return add("textures", {{"source", image}, {"sampler", sampler}});
}

std::size_t GlbWriter::add_camera(const Camera& camera, const std::string& name) {
    const glm::dvec3 back = glm::normalize(camera.eye - camera.target),
                     helper = std::abs(back.y) < 0.999 ? glm::dvec3(0, 1, 0) : glm::dvec3(0, 0, 1),
                     right = glm::normalize(glm::cross(helper, back)), up = glm::cross(back, right);
    const std::size_t lens =
        add("cameras", {{"type", "perspective"}, {"perspective", {{"yfov", camera.fov_rad}, {"znear", 0.01}}}});
    const glm::dquat turn = glm::quat_cast(glm::dmat3(right, up, back));
    return add("nodes", {{"name", name},
                         {"camera", lens},
                         {"translation", {camera.eye.x, camera.eye.y, camera.eye.z}},
                         {"rotation", {turn.x, turn.y, turn.z, turn.w}}});
}

GlbWriter::Json GlbWriter::material_of(const Material& material, int base_texture) {
    const glm::vec4& c = material.base_color;
    Json pbr = {{"baseColorFactor", {c.r, c.g, c.b, c.a}}, {"metallicFactor", 0.0}, {"roughnessFactor", 1.0}};
    if (base_texture >= 0) pbr["baseColorTexture"] = {{"index", base_texture}};
    Json result = {{"name", material.name}, {"pbrMetallicRoughness", std::move(pbr)}};
    if (material.alpha_mask) result["alphaMode"] = "MASK", result["alphaCutoff"] = material.alpha_cutoff;
    if (material.alpha_blend) result["alphaMode"] = "BLEND";
    return result;
}

GlbWriter::Json GlbWriter::matrix_of(const glm::dmat4& matrix) {
    Json numbers = Json::array();
    for (int i = 0; i < 16; ++i) numbers.push_back(matrix[i / 4][i % 4]);
    return numbers;
}

std::string GlbWriter::file() {
    Json roots = Json::array();
    if (document.contains("nodes"))
        for (std::size_t i = 0; i < document["nodes"].size(); ++i) roots.push_back(i);
    Json scene = Json::object();
    if (!roots.empty()) scene["nodes"] = std::move(roots);
    document["scenes"] = Json::array({std::move(scene)});
    if (!binary_.empty()) document["buffers"] = Json::array({Json{{"byteLength", binary_.size()}}});
    std::string json = document.dump(-1, ' ', false, Json::error_handler_t::replace);
    json.resize((json.size() + 3) / 4 * 4, ' ');
    std::string bytes;
    const std::size_t binary_chunk = binary_.empty() ? 0 : 8 + binary_.size();
    bytes.reserve(20 + json.size() + binary_chunk);
    const auto word = [&bytes](std::size_t value) {  // little endian
        for (unsigned k = 0; k < 4; ++k) bytes.push_back(static_cast<char>(value >> (8 * k) & 0xFF));
    };
    for (const std::size_t value : {std::size_t{kMagic}, std::size_t{kVersion}, 20 + json.size() + binary_chunk,
                                    json.size(), std::size_t{kJsonChunk}})
        word(value);
    bytes += json;
    if (binary_chunk == 0) return bytes;
    word(binary_.size());
    word(kBinaryChunk);
    return bytes += binary_;
}

}  // namespace gonio
