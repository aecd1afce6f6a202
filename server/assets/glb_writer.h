// Binary glTF, part by part. Only for .cpp files: it has a JSON library's type.
#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "server/scene/asset.h"

namespace gonio {

class GlbWriter {
public:
    using Json = nlohmann::ordered_json;
    // glTF 2.0, 3.6.2.2: component types.
    static constexpr int kFloat = 5126, kUnsignedInt = 5125, kUnsignedShort = 5123;

    GlbWriter();
    Json document;  // what is not added below is the caller's; buffers and scenes are file()'s

    // Each result: the index of what was added.
    std::size_t add_view(const void* bytes, std::size_t size);
    template <typename T>
    std::size_t add_accessor(const std::vector<T>& values, int component_type, const char* type,
                             const Json& more = {}) {
        return add_accessor(add_view(values.data(), values.size() * sizeof(T)), values.size(), component_type, type,
                            more);
    }
    std::size_t add_positions(const std::vector<glm::vec3>& positions);  // with their bounds
    std::size_t add_image(std::span<const std::byte> png);
    std::size_t add_texture(std::size_t image, Wrap wrap_s, Wrap wrap_t);
    std::size_t add(const char* list, Json element);                        // "nodes", "materials"
    std::size_t add_camera(const Camera& camera, const std::string& name);  // with its node

    // Result: the material's name, base colour and alpha, as a diffuse surface. base_texture: -1: none.
    static Json material_of(const Material& material, int base_texture);
    static Json matrix_of(const glm::dmat4& matrix);

    std::size_t binary_bytes() const { return binary_.size(); }
    // Result: the bytes of the .glb, in which all nodes are roots of one scene. Call it once.
    std::string file();

private:
    std::size_t add_accessor(std::size_t view, std::size_t count, int component_type, const char* type,
                             const Json& more);
    std::string binary_;
};

}  // namespace gonio
