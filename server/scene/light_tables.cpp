#include "server/scene/light_tables.h"

namespace gonio {

std::optional<ies::PhotometricWeb> LightTables::web_for_lighting(const Profile& profile) {
    return ies::thinned(profile.photometry.web, Angle::degrees(kLeastStepV_deg), Angle::degrees(kLeastStepH_deg));
}

LightTables::LightTables(const Profile& profile, const std::optional<ies::PhotometricWeb>& thin)
    : directions(thin ? *thin : profile.photometry.web) {
    const ies::PhotometricWeb& own = profile.photometry.web;
    const ies::PhotometricWeb& web = thin ? *thin : own;
    const auto size_of = [](const ies::PhotometricWeb& one) {
        return std::to_string(one.v_rad.size()) + " x " + std::to_string(one.h_rad.size());
    };
    if (thin)
        thinned = "The web of '" + profile.name + "' is finer than a picture shows: of its " + size_of(own) +
                  " angles lighting takes means over " + size_of(web) + "; meters take its direct light as it is.";
    words = pack_web(web, profile.peak_cd);
    lit = directions.lit_directions();
    beam_cos = directions.beam_cosine();
    uniform = uniform_grid(web);
    mask_size = mask_face_size(web);
}

const LightTables& tables_of(const Profile& profile) {
    const std::lock_guard lock(profile.tables.mutex);
    if (!profile.tables.made) profile.tables.made = std::make_shared<const LightTables>(profile);
    return *profile.tables.made;
}

std::string known_thinned(const Profile& profile) {
    const std::lock_guard lock(profile.tables.mutex);
    return profile.tables.made ? profile.tables.made->thinned : "";
}

}  // namespace gonio
