// MVR shows and glTF files -> the scene that is shown. Any thread; memory and time are those of load_scene.
#pragma once

#include <cstddef>
#include <memory>
#include <string>

#include "ies/core/result.h"
#include "server/assets/assets.h"
#include "server/exchange/mvr.h"
#include "server/scene/asset.h"

namespace gonio::exchange {

// bytes: an .mvr. shown: the scene's name, and the place of errors. room: bytes of memory that may be taken.
// Result: objects as instances of their models, fixtures as lights with the webs of their beams, their patch. Its
// warnings are the lines of the import report. Errors: of read_mvr, "too_large".
Result<std::shared_ptr<SceneAsset>> import_mvr(std::string bytes, const std::string& shown, const LoadOptions& options,
                                               std::size_t room);

// As load_scene, which it is for all but archives: those are MVR shows.
Result<std::shared_ptr<const SceneAsset>> load_any_scene(const std::string& name, const std::string& shown = "",
                                                         const LoadOptions& options = {},
                                                         std::size_t most_bytes = SIZE_MAX);

}  // namespace gonio::exchange
