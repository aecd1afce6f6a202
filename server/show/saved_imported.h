// What an MVR show said last, as a saved show keeps it. Pure.
#pragma once

#include "protocol/schema/saved.pb.h"

namespace gonio {

struct Scene;

void put_imported(const Scene& scene, saved::Show& show);
// The lights are there, with their names. A show of an earlier version says nothing: then what the scene's file says
// now stands, and no light is missing. What the show says that cannot be is left out.
void restore_imported(const saved::Show& show, Scene& scene);

}  // namespace gonio
