#include "server/assets/gltf.h"

#include <algorithm>
#include <exception>

#include "protocol/shortened_text.h"
#include "server/assets/gltf_document.h"
#include "server/assets/gltf_import.h"

namespace gonio {

void GltfImport::warn(std::string sentence) {
    auto& warnings = scene.warnings;
    if (warnings.size() >= kMaxWarnings || std::find(warnings.begin(), warnings.end(), sentence) != warnings.end())
        return;
    warnings.push_back(warnings.size() + 1 == kMaxWarnings ? "more warnings were left out" : std::move(sentence));
}

Result<std::shared_ptr<const SceneAsset>> load_gltf(const std::string& path, const std::string& name) {
    try {
        const auto document = read_gltf_document(path);
        if (!document) return document.error();
        auto scene = std::make_shared<SceneAsset>();
        scene->name = shortened_text(name, 4096);
        GltfImport import{*document, *scene, {}, {}, 0};
        for (const std::string& warning : document->warnings) import.warn(warning);
        for (const auto step : {import_materials, import_meshes, import_nodes}) {
            const auto done = step(import);
            if (!done) return done.error();
        }
        if (scene->instances.empty()) import.warn("the scene has no triangles");
        return std::shared_ptr<const SceneAsset>(std::move(scene));
    } catch (const std::exception& error) {
        // The parts answer with Result; what is left is memory that ran out or a fault of a third-party reader.
        return Error{"bad_gltf", path, error.what(), "the scene file could not be read"};
    }
}

}  // namespace gonio
