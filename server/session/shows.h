// Shows and gels for clients: what is in the folder of shows, the text of one, and saving. The disk is the loader's;
// nothing here waits for it. Render thread.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "server/scene/gel.h"
#include "server/session/loader.h"
#include "server/session/replies.h"
#include "server/session/scene_access.h"

namespace gonio {

// Answers with Shows, or why not: "too_large" where a text is larger than kMaxShownBytes.
void answer_shows(const Work& work, const Scene& scene, const SceneAccess& access, Loader& loader, Replies& replies);

// Checks what save_show asks for and completes its name. Result: why not: "unsupported" without a folder,
// "invalid_argument" for a name.
std::optional<Error> check_save(v1::SaveShow& save, const Scene& scene, const SceneAccess& access);
// Writes the scene as it is to the show's file. `done` gets the work with its failure and the revision that was
// written, on the loader's thread. Result: false where too much waits.
bool save_show(Work work, const Scene& scene, const SceneAccess& access, Loader& loader,
               std::function<void(Work)> done);

// The same two of rename_show and remove_show: what is wrong with the names, and the work of the loader.
std::optional<Error> check_show_edit(v1::ClientMessage& message, const SceneAccess& access);
bool edit_shows(Work work, const SceneAccess& access, Loader& loader, std::function<void(Work)> done);

// Result: what there is in the scene, for people: "cornell: 3 luminaires, 2 presets; not saved".
std::string words_of(const Scene& scene);

v1::Gels gels_reply(const Gels* gels);

}  // namespace gonio
