// A saved show -> the commands that bring it back, carried out on a scene. Of this folder alone. Any thread.
#pragma once

#include <chrono>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "protocol/schema/saved.pb.h"
#include "server/scene/apply.h"
#include "server/scene/scene.h"

namespace gonio {

// Result: the light of the file that has this name; nullptr: none has it.
const LightSeed* seed_named(const SceneAsset& asset, const std::string& name);

// Keeps the refusals of its commands as warnings. The parts can be restored alone, in the order in which they stand.
class ShowRestorer {
public:
    // show: outlives this.
    ShowRestorer(const saved::Show& show, Scene scene);

    // After the time no profile is read any more.
    void read_profiles(std::chrono::milliseconds profile_time);
    // By Profile.key: instead of those of the show.
    void set_profiles(std::map<std::string, std::shared_ptr<const Profile>> profiles) {
        profiles_ = std::move(profiles);
    }
    // From now on all that changes has the revision after that of the scene, which stays.
    void keep_revision() { one_revision_ = true; }

    Scene& scene() { return scene_; }
    std::vector<std::string>& warnings() { return warnings_; }
    void warn(std::string text);
    void run(Scene& scene, const v1::Command& command, const Loaded& loaded, const std::string& what);
    void run(const v1::Command& command, const std::string& what);
    std::shared_ptr<const Profile> profile_of(const saved::Light& light) const;
    void fill(v1::SetLight& set, const saved::Light& light, const std::string& what);
    // As a light that is added.
    void add(Scene& scene, const saved::Light& light, const std::string& what);
    // Whether a light that is none of the scene's file is a sun, and how a head is mounted. No command sets these: they
    // come from scene files, and a show has them of lights that were kept when their file was replaced. Result: whether
    // one of them is another than before.
    bool restore_kind(Light& light, const saved::Light& saved, const std::string& what);

    void restore_technique();
    void restore_names();  // before anything names a light
    void restore_presets();
    void restore_cue_options();
    void restore_lights();
    void restore_groups();
    void restore_camera();
    void restore_exposure();
    void restore_view_lights();
    void restore_saved_views();
    void restore_grids();  // after the saved views: a grid may name one
    void restore_observers();
    void restore_size();  // after the lights: how large a picture may be depends on how many there are
    void restore_haze();
    void restore_false_colors();
    void restore_look();
    void restore_view();
    void restore_master();
    void restore_patch();
    void restore_surfaces();

private:
    // empty: the scene without lights.
    std::shared_ptr<const Preset> content_of(const Scene& empty,
                                             const google::protobuf::RepeatedPtrField<saved::Light>& kept,
                                             const std::string& what);
    // Of the view of this name; written before there was one, the defaults stay.
    void restore_false_color(const char* name, const v1::FalseColor& color);

    const saved::Show& show_;
    Scene scene_;
    bool one_revision_ = false;
    std::map<std::string, std::shared_ptr<const Profile>> profiles_;
    std::vector<std::string> warnings_;
};

}  // namespace gonio
