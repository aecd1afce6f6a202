// Scene -> the State message that clients see.
#pragma once

#include "protocol/schema/messages.h"
#include "server/scene/light.h"

namespace gonio {

struct Scene;

// Result: everything.
v1::State full_state(const Scene& scene);
// Result: where the show is kept, and whether the file has it as it is; without can_save. How one looks at it (camera,
// view, exposure, size, technique) does not count.
v1::ShowFile show_file(const Scene& scene);
// Result: what changed after that revision, where no light and no group has gone since.
v1::StateChanged state_change(Revision since, const Scene& scene);
// Result: what `after` has that `before` had otherwise; lights whole, the rest field by field.
v1::StateChanged state_change(const Scene& before, const Scene& after);

}  // namespace gonio
