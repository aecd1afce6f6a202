// What an MVR show said last of its lights and groups. Its next edition is compared with it, and with what was made of
// it here since: apply_merge.h.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/schema/messages.h"

namespace gonio {

struct Light;
struct Scene;
struct SceneAsset;

struct ImportedLight {
    std::string uuid;    // of its fixture; empty: none
    std::string beam;    // its geometry, of a fixture with several; else empty
    std::string number;  // FixtureIDNumeric, else FixtureID
    std::string type, mode, addresses;
    std::string name;  // that the file gives the light
    // The rest is that of the scene's file (imported_of).
    glm::dvec3 position{0.0};
    glm::dquat world_from_light{1.0, 0.0, 0.0, 0.0};
    std::string rows;  // digest of its rows of the patch; empty: it has none
    // True if somebody had given the light another profile before it went missing, or before it was kept beside another
    // file.
    bool own_web = false;
    bool gone = false;  // its fixture was in an earlier edition alone
};

struct ImportedGroup {  // a group, a layer, a class or a position of the show
    std::string name;
    std::vector<std::uint32_t> lights;  // indices into Imported::lights
};

struct Imported {
    std::vector<ImportedLight> lights;  // those of the file first, as SceneAsset::lights
    std::vector<ImportedGroup> groups;
    int universe_offset = 0;  // that the file was loaded with: its rows have it
};

// Result: a digest of what the rows of each target say, by target.
std::map<std::string, std::string> row_digests(const v1::SetPatch* patch);
// Result: what the scene's file says, with the places of its lights and their rows; null: it is no MVR show.
std::shared_ptr<const Imported> imported_of(const SceneAsset& asset);
// Notes that somebody gave the light another profile, where its file is not the scene's any more: the next edition of
// its show must not take that profile away. Undo of the change leaves the note.
void note_own_profile(Scene& scene, const Light& light);
// Result: the number of the light's fixture in the show; empty: it has none. Stands as long as Scene::imported.
std::string_view fixture_of(const Scene& scene, const Light& light);
// Of a scene that was made of its file just now: its lights know what they came from, and its groups are there.
void take_imported(Scene& scene);

}  // namespace gonio
