// Of apply(): the camera, and the places that it has names for.
#pragma once

#include <string>

namespace gonio {
struct Scene;
}  // namespace gonio

namespace gonio::v1 {
class SaveView;
class SetCamera;
}  // namespace gonio::v1

namespace gonio {

// All on the render thread, on apply()'s copy of the scene; they throw Refused (apply_checks.h) and then have changed
// nothing. Codes: "invalid_argument", "not_found", "too_many_views".
void set_camera(Scene& scene, const v1::SetCamera& set);
// What it does not name is as the camera is now.
void save_view(Scene& scene, const v1::SaveView& save);
void recall_view(Scene& scene, const std::string& name);
void remove_view(Scene& scene, const std::string& name);

}  // namespace gonio
