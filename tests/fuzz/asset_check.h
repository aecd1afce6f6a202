// What the readers of scene files and of what is packed into them promise, whatever the bytes. Shared by the fuzz
// targets and their replay test.
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <cmath>
#include <span>
#include <string>

#include "server/assets/assets.h"
#include "server/assets/draco_mesh.h"
#include "server/assets/gltf_expand.h"
#include "server/assets/gltf_import.h"
#include "tests/fuzz/require.h"

namespace gonio::fuzz {

inline void check_draco(ByteView bytes) {
    const DracoAttribute wanted[] = {{0, 5126, 3}, {1, 5126, 3}, {2, 5126, 2}};
    const DracoBounds bounds{1 << 14, 1 << 14, 1 << 24};
    for (const std::size_t attributes : {std::size_t{0}, std::size_t{3}}) {
        const auto mesh = decode_draco(bytes, std::span(wanted).first(attributes), bounds, "/place");
        if (!mesh) {
            check_refusal(mesh.error());
            continue;
        }
        require(mesh->points <= bounds.points && mesh->indices.size() <= 3 * bounds.faces);
        for (const std::uint32_t index : mesh->indices) require(index < mesh->points);
        for (std::size_t i = 0; i < attributes; ++i)
            require(mesh->attributes[i].size() == mesh->points * wanted[i].components * sizeof(float));
    }
}

// The first four bytes are mode, filter, stride and count.
inline void check_meshopt(ByteView bytes) {
    if (bytes.size() < 4) return;
    static const std::string modes[] = {"ATTRIBUTES", "TRIANGLES", "INDICES"};
    static const std::string filters[] = {"NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL"};
    const auto number = [&](std::size_t at) { return std::to_integer<std::size_t>(bytes[at]); };
    const std::size_t stride = 2 * number(2), count = 3 * number(3);
    const auto decoded =
        decode_meshopt(bytes.subspan(4), modes[number(0) % 3], filters[number(1) % 4], count, stride, "/place");
    if (!decoded) return check_refusal(decoded.error());
    require(decoded->size() == count * stride);
}

inline void check_image(ByteView bytes) {
    constexpr std::size_t most = 1 << 20;
    const auto image = decode_image(bytes, "/place", most);
    if (!image) return check_refusal(image.error());
    const std::size_t pixels = static_cast<std::size_t>(image->width_px) * static_cast<std::size_t>(image->height_px);
    require(pixels > 0 && pixels <= most && image->rgba.size() == 4 * pixels);
}

// The bytes as a .glb or .gltf file.
inline void check_scene(ByteView bytes) {
    const int file = memfd_create("scene", MFD_CLOEXEC);
    require(file >= 0 && write(file, bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size()));
    const auto scene = load_scene("/proc/self/fd/" + std::to_string(file), "scene", {}, std::size_t{1} << 27);
    close(file);
    if (!scene) return check_refusal(scene.error());
    const SceneAsset& asset = **scene;
    require(asset.warnings.size() <= GltfImport::kMaxWarnings && !asset.materials.empty());
    for (const Mesh& mesh : asset.meshes) {
        require(mesh.material >= 0 && static_cast<std::size_t>(mesh.material) < asset.materials.size());
        for (const std::uint32_t index : mesh.indices) require(index < mesh.vertices.size());
        for (const Vertex& vertex : mesh.vertices) require(std::isfinite(vertex.position.x + vertex.normal.x));
    }
    for (const Instance& instance : asset.instances)
        require(instance.mesh >= 0 && static_cast<std::size_t>(instance.mesh) < asset.meshes.size());
    for (const Material& material : asset.materials) {
        for (const int image : {material.base_color_image, material.emissive_image})
            require(image < static_cast<int>(asset.images.size()));
    }
}

}  // namespace gonio::fuzz
