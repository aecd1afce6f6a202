// What lighting computes of a profile.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "server/scene/direction_table.h"
#include "server/scene/profile.h"
#include "server/scene/web_buffer.h"

namespace gonio {

// Finer steps of a web than a picture shows, 2 mm at 10 m: lighting takes means over them (ies::thinned).
inline constexpr double kLeastStepV_deg = 0.01, kLeastStepH_deg = 0.05;

// Immutable. Bounded by its web, of 36,000 × 14,400 angles at most, and ies::kMaxGridValues.
struct LightTables {
    explicit LightTables(const Profile& profile) : LightTables(profile, web_for_lighting(profile)) {}

    std::string thinned;  // a sentence for the report where the web was too fine; else empty
    DirectionTable directions;
    std::vector<std::uint32_t> words;  // pack_web
    std::vector<glm::vec3> lit;        // DirectionTable::lit_directions
    float beam_cos;                    // DirectionTable::beam_cosine
    float core_cos;                    // core_cosine
    bool uniform;                      // equally spaced angles
    int mask_size;                     // mask_face_size

private:
    static std::optional<ies::PhotometricWeb> web_for_lighting(const Profile& profile);  // none: its own
    LightTables(const Profile& profile, const std::optional<ies::PhotometricWeb>& thin);
};

// Result: the cosine of the least half-angle about the photometric zero beyond which a web has less than a twentieth of
// its peak; -1 where that is more than 75°.
float core_cosine(const ies::PhotometricWeb& web, double peak_cd);

// Result: the profile's, made when first asked for: in some milliseconds, of the finest webs in half a second. Who
// would hold the render thread asks before the profile gets there. They stay until forget_tables(): whoever goes on
// with them takes shared_tables_of(). Any thread.
const LightTables& tables_of(const Profile& profile);
std::shared_ptr<const LightTables> shared_tables_of(const Profile& profile);
// The profile gives up its tables, which take a megabyte and more: nothing shows it for now. Any thread.
void forget_tables(const Profile& profile);
// Result: the profile, with which these tables of it stay.
std::shared_ptr<const Profile> with_tables(std::shared_ptr<const Profile> profile,
                                           std::shared_ptr<const LightTables> tables);
// Gives a profile of the same web the other's tables, which are made where they are not yet. No thread may know `to`.
void share_tables(const Profile& from, Profile& to);
// Result: LightTables::thinned of tables that are made already; else empty.
std::string known_thinned(const Profile& profile);

}  // namespace gonio
