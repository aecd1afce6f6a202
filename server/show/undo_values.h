// The values of undo's steps <-> what is kept of them on disk (protocol/schema/undo_file.proto). Of this folder alone.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "protocol/schema/undo_file.pb.h"
#include "server/scene/edit.h"
#include "server/show/saved_show.h"

namespace gonio {

// Puts values into the steps of one scene; profiles and presets that several values share are written once.
class UndoValueWriter {
public:
    UndoValueWriter(const Scene& scene, ProfileTexts& texts, saved::UndoSteps& out)
        : scene_(scene), texts_(texts), out_(out) {}
    void put(const EditKey& key, saved::UndoKey& out) const;
    void put(const EditValue& value, saved::UndoValue& out);

private:
    template <typename Out>  // saved::Light or saved::UndoValue
    void put_profile(const std::shared_ptr<const Profile>& profile, Out& out);
    void put_light(const LightValues& light, const std::string& name, saved::Light& out);
    std::uint32_t index_of(const std::shared_ptr<const Preset>& preset);

    const Scene& scene_;
    ProfileTexts& texts_;
    saved::UndoSteps& out_;
    std::set<std::string> profiles_;
    std::map<std::shared_ptr<const Preset>, std::uint32_t> presets_;
};

// Reads them for a scene, whose lights have the ids that the steps name.
class UndoValueReader {
public:
    // Reads profiles and presets at once. Profiles and presets that the scene has are shared with it.
    UndoValueReader(const saved::UndoSteps& steps, const Scene& scene);
    // Result: nothing where it cannot be read, or is no value of such a key.
    std::optional<EditKey> key(const saved::UndoKey& saved) const;
    std::optional<EditValue> value(const EditKey& key, const saved::UndoValue& saved) const;

private:
    std::shared_ptr<const Profile> seed_profile(const std::string& name) const;
    std::shared_ptr<const Profile> kept_profile(const std::string& key) const;
    std::optional<std::shared_ptr<const Gel>> gel(const std::string& name) const;
    bool read_light(const saved::Light& saved, LightValues& light) const;
    std::optional<EditValue> existing_light(std::uint32_t id, const saved::UndoExistingLight& saved) const;
    std::optional<EditValue> cue(const saved::UndoCue& saved) const;
    void read_profiles(const saved::UndoSteps& steps);
    void read_presets(const saved::UndoSteps& steps);

    const Scene& scene_;
    std::map<std::string, std::shared_ptr<const Profile>> profiles_;
    std::vector<std::shared_ptr<const Preset>> presets_;  // null: it cannot be read
};

}  // namespace gonio
