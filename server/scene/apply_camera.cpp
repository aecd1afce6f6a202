#include "server/scene/apply_camera.h"

#include "protocol/schema/scene.pb.h"
#include "server/scene/apply_checks.h"
#include "server/scene/limits.h"
#include "server/scene/scene.h"

namespace gonio {
namespace {

// set: SetCamera or SaveView; where: its name. Result: the camera with what it names.
template <typename Set>
Camera camera_with(Camera camera, const Set& set, const std::string& where) {
    const double far = row_of(Property::position).most;
    if (set.eye_m_size() > 0) camera.eye = checked_vector(set.eye_m(), -far, far, where + ".eye_m");
    if (set.target_m_size() > 0) camera.target = checked_vector(set.target_m(), -far, far, where + ".target_m");
    if (set.has_fov_rad()) camera.fov_rad = checked(set.fov_rad(), 0.02, 3.0, where + ".fov_rad");
    if (glm::distance(camera.eye, camera.target) < 1e-6) {
        refuse("invalid_argument", where + ".target_m", print_all(set.target_m()), "eye and target must not coincide");
    }
    return camera;
}

void move_camera(Scene& scene, const Camera& camera) {
    change(scene, scene.camera.eye, camera.eye, scene.camera_rev);
    change(scene, scene.camera.target, camera.target, scene.camera_rev);
    change(scene, scene.camera.fov_rad, camera.fov_rad, scene.camera_rev);
}

}  // namespace

void set_camera(Scene& scene, const v1::SetCamera& set) {
    move_camera(scene, camera_with(scene.camera, set, "set_camera"));
}

void save_view(Scene& scene, const v1::SaveView& save) {
    const std::string name = checked_name(save.name(), "save_view.name");
    if (!scene.saved_views.contains(name) && scene.saved_views.size() >= kMaxSavedViews)
        refuse("too_many_views", "save_view.name", name,
               "a scene keeps at most " + std::to_string(kMaxSavedViews) + " views");
    scene.saved_views[name] = camera_with(scene.camera, save, "save_view");
    scene.saved_views_rev = scene.scene_rev + 1;
}

void recall_view(Scene& scene, const std::string& name) {
    const auto view = scene.saved_views.find(name);
    if (view == scene.saved_views.end()) refuse_unknown("recall_view.name", name, "saved view", scene.saved_views);
    move_camera(scene, view->second);
}

void remove_view(Scene& scene, const std::string& name) {
    if (scene.saved_views.erase(name) == 0) refuse_unknown("remove_view.name", name, "saved view", scene.saved_views);
    scene.saved_views_rev = scene.scene_rev + 1;
}

}  // namespace gonio
