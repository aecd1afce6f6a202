// What the importer takes of skins and animations, from a checked document before they are dropped.
#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "server/assets/gltf_document.h"

namespace gonio {

std::vector<GltfSkin> skins_of(const nlohmann::json& document);

// KHR_animation_pointer: a node whose KHR_node_visibility an animation sets -> the accessor of its keys. Of several
// animations the first counts. Pointers that lead nowhere have no entry.
std::map<int, int> visibility_keys_of(const nlohmann::json& document);

// KHR_lights_punctual: a spot may lack its object, whose members have defaults. tinygltf would refuse it.
void complete_spots(nlohmann::json& document);

}  // namespace gonio
