#include "server/scene/light_tables.h"

#include <utility>

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
    core_cos = core_cosine(web, profile.peak_cd);
    uniform = uniform_grid(web);
    mask_size = mask_face_size(web);
}

const LightTables& tables_of(const Profile& profile) {
    return *shared_tables_of(profile);  // which the profile has as well
}

std::shared_ptr<const LightTables> shared_tables_of(const Profile& profile) {
    const std::lock_guard lock(profile.tables.mutex);
    if (!profile.tables.made) profile.tables.made = std::make_shared<const LightTables>(profile);
    return profile.tables.made;
}

void forget_tables(const Profile& profile) {
    std::shared_ptr<const LightTables> forgotten;  // and freed without the lock
    const std::lock_guard lock(profile.tables.mutex);
    forgotten.swap(profile.tables.made);
}

std::shared_ptr<const Profile> with_tables(std::shared_ptr<const Profile> profile,
                                           std::shared_ptr<const LightTables> tables) {
    const Profile* const shown = profile.get();
    const auto both = std::make_shared<std::pair<std::shared_ptr<const Profile>, std::shared_ptr<const LightTables>>>(
        std::move(profile), std::move(tables));
    return {both, shown};
}

void share_tables(const Profile& from, Profile& to) {
    to.tables.made = shared_tables_of(from);
}

std::string known_thinned(const Profile& profile) {
    const std::lock_guard lock(profile.tables.mutex);
    return profile.tables.made ? profile.tables.made->thinned : "";
}

float core_cosine(const ies::PhotometricWeb& web, double peak_cd) {
    constexpr double kBright = 0.05, kStep_rad = 0.5 * std::numbers::pi / 180.0, kWidest_rad = 1.3;
    constexpr int kAround = 24;
    double widest = 0.0;
    for (double angle = 0.0; angle <= std::numbers::pi; angle += kStep_rad) {
        for (int i = 0; i < kAround; ++i) {
            const double turn = 2.0 * std::numbers::pi * i / kAround;
            const double cd_there = ies::intensity(web, {std::sin(angle) * std::cos(turn),
                                                         std::sin(angle) * std::sin(turn), -std::cos(angle)})
                                        .in(cd);
            if (cd_there > kBright * peak_cd) widest = angle;
        }
        if (widest > kWidest_rad) return -1.0f;
    }
    return static_cast<float>(std::cos(widest + kStep_rad));
}

}  // namespace gonio
