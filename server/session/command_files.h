// The files that come with a command -> what apply() takes. May run on any thread; reads scene files from disk, and
// makes what takes long of them.
#pragma once

#include "ies/core/result.h"
#include "protocol/schema/messages.h"
#include "server/scene/apply.h"
#include "server/session/library.h"
#include "server/session/scene_access.h"

namespace gonio {

inline constexpr std::size_t kMaxProfileBytes = 1u << 20;  // a larger uploaded profile is refused: "too_large"

inline constexpr std::size_t kMostOpenWarnings = 32;  // of a show that was opened; the rest is counted

// Result: whether the command has to be read before it can be applied: a scene, a show, or a light's profile.
bool needs_files(const v1::Command& command);
// Result: the profiles that the scene's file brings, and what its lights, presets and cues have.
std::vector<std::shared_ptr<const Profile>> profiles_of(const Scene& scene);
// library: where a profile without photometry is sought; null: among the built-in ones. What is uploaded is kept there.
// Errors: of scene_path, load_scene, make_profile and Library::profile; of a show's name, file and content;
// "too_large". Throws std::exception where there is not enough memory.
Result<Loaded> read_files(const v1::Command& command, const SceneAccess& access = {}, Library* library = nullptr);

}  // namespace gonio
