// Which surfaces go into one file of a show.
#include <algorithm>
#include <array>
#include <map>
#include <numeric>

#include "server/exchange/export_parts.h"

namespace gonio::exchange {
namespace {

constexpr std::size_t kMostFiles = 2000;  // of surfaces; an archive may have 10,000

}  // namespace

std::vector<GeometryGroup> geometry_groups(const SceneAsset& asset) {
    // Pictures that one material has belong together.
    std::vector<std::size_t> leader(asset.images.size());
    std::iota(leader.begin(), leader.end(), std::size_t{0});
    const auto find = [&](int image) {
        auto at = static_cast<std::size_t>(image);
        while (leader[at] != at) at = leader[at] = leader[leader[at]];
        return at;
    };
    const auto images_of = [](const Material& material) {
        return std::array{material.base_color_image, material.emissive_image, material.normal_image,
                          material.transmission_image};
    };
    for (const Material& material : asset.materials) {
        int first = -1;
        for (const int image : images_of(material)) {
            if (image < 0) continue;
            if (first >= 0) leader[find(image)] = find(first);
            first = image;
        }
    }
    // A key of pictures, or of a mesh and whether it is mirrored.
    std::vector<GeometryGroup> groups;
    std::map<std::pair<std::size_t, int>, std::size_t> known;
    for (std::size_t i = 0; i < asset.instances.size(); ++i) {
        const Instance& instance = asset.instances[i];
        const Mesh& mesh = asset.meshes[static_cast<std::size_t>(instance.mesh)];
        const auto images = images_of(asset.materials[static_cast<std::size_t>(mesh.material)]);
        const auto image = std::ranges::find_if(images, [](int one) { return one >= 0; });
        const bool textured = image != images.end();
        const int sign = glm::determinant(glm::dmat3(instance.world_from_mesh)) < 0.0 ? 1 : 0;
        const auto key =
            textured ? std::pair(find(*image), 2) : std::pair(static_cast<std::size_t>(instance.mesh), sign);
        const auto [at, fresh] = known.try_emplace(key, groups.size());
        if (fresh) groups.push_back({{}, textured});
        groups[at->second].instances.push_back(i);
    }
    if (groups.size() <= kMostFiles) return groups;
    GeometryGroup all{std::vector<std::size_t>(asset.instances.size()), true};
    std::iota(all.instances.begin(), all.instances.end(), std::size_t{0});
    return {all};
}

}  // namespace gonio::exchange
