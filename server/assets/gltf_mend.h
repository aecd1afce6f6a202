// What a glTF document says otherwise than the format wants it, but can mean one thing only, or nothing of weight. It
// is put right before the document is checked, so that one slip does not refuse the file.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace gonio {

// document: any JSON value. Integers written as 1.0, and a version that is a number, become what they mean. What names
// a texture, sampler or image that is not there names none; warnings say where, and whether lux change. A texture whose
// image is gone and that a material uses is told of by the material's own importer.
void mend_gltf(nlohmann::json& document, std::vector<std::string>& warnings);

}  // namespace gonio
