#include "server/show/saved_profile.h"

#include <cstdint>
#include <numbers>

#include "protocol/text/shortened_text.h"
#include "server/assets/assets.h"
#include "server/base/sha256.h"
#include "server/scene/apply.h"
#include "server/scene/limits.h"
#include "server/scene/packed_gobo.h"

namespace gonio {
namespace {

std::string saved_bytes(std::span<const std::uint16_t> shares) {
    std::string bytes;
    bytes.reserve(2 * shares.size());
    for (const std::uint16_t share : shares) {
        bytes.push_back(static_cast<char>(share & 0xff));
        bytes.push_back(static_cast<char>(share >> 8));
    }
    return bytes;
}

Result<std::vector<std::uint16_t>> read_saved(std::string_view bytes, const std::string&) {
    std::vector<std::uint16_t> shares;
    shares.reserve(bytes.size() / 2);
    for (std::size_t i = 0; i + 1 < bytes.size(); i += 2)
        shares.push_back(static_cast<std::uint16_t>(static_cast<unsigned char>(bytes[i]) |
                                                    static_cast<unsigned char>(bytes[i + 1]) << 8));
    return shares;
}

// Result: of the picture's file; empty: the slot has no picture.
std::string picture_hash(const Gobo& gobo) {
    if (gobo.packed) return gobo.packed->sha256.empty() ? sha256(gobo.packed->bytes) : gobo.packed->sha256;
    return gobo.transmission.empty() ? "" : sha256(saved_bytes(gobo.transmission));
}

std::shared_ptr<const Gobos> gobos_of(const saved::Profile& profile, std::vector<std::string>& warnings) {
    if (profile.gobos().empty()) return nullptr;
    auto gobos = std::make_shared<Gobos>();
    for (const saved::Gobo& saved : profile.gobos()) {
        if (gobos->size() >= kMostGoboSlots) break;
        Gobo& gobo = gobos->emplace_back();
        gobo.name = shortened_text(saved.name(), kMaxNameBytes);
        const std::size_t side = saved.size_px(), bytes = saved.transmission().size();
        if (side > kMostSavedGobo_px || bytes != 2 * side * side) {
            warnings.push_back("the gobo '" + gobo.name + "' of the profile '" + profile.name() +
                               "' is not restored: its picture is not whole");
            continue;
        }
        gobo.size_px = static_cast<int>(side);
        if (!is_sha256(saved.sha256())) {
            gobo.transmission = *read_saved(saved.transmission(), "");
            continue;
        }
        auto packed = std::make_shared<PackedGobo>();
        packed->bytes = saved.transmission();
        packed->sha256 = saved.sha256();
        packed->place = gobo.name;
        packed->decode = read_saved;
        gobo.packed = std::move(packed);
    }
    return gobos;
}

}  // namespace

bool has_gate(const Profile& profile) {
    return profile.gobos != nullptr || profile.open_width_rad > 0.0;
}

std::string gate_hash(const Profile& profile) {
    std::string all = std::to_string(profile.open_width_rad) + '\n';
    if (profile.gobos)
        for (const Gobo& gobo : *profile.gobos) all += gobo.name + '\0' + picture_hash(gobo) + '\n';
    return sha256(all);
}

void put_gate(const Profile& profile, saved::Profile& saved) {
    saved.set_open_width_rad(profile.open_width_rad);
    if (!profile.gobos) return;
    for (const Gobo& gobo : *profile.gobos) {
        saved::Gobo& slot = *saved.add_gobos();
        slot.set_name(gobo.name);
        if (gobo.packed) slot.set_sha256(picture_hash(gobo));
        const std::span<const std::uint16_t> shares = transmission_of(gobo);
        if (shares.empty()) continue;  // it is open
        slot.set_size_px(static_cast<std::uint32_t>(gobo.size_px));
        slot.set_transmission(saved_bytes(shares));
    }
}

void take_gate(const saved::Profile& saved, Profile& profile, std::vector<std::string>& warnings) {
    profile.gobos = gobos_of(saved, warnings);
    const double width_rad = saved.open_width_rad();
    profile.open_width_rad = width_rad > 0.0 && width_rad < 2.0 * std::numbers::pi ? width_rad : 0.0;
}

Result<std::shared_ptr<Profile>> restored_profile(const saved::Profile& saved, std::vector<std::string>& warnings) {
    const auto read = make_profile(saved.name(), saved.photometry());
    if (!read) return read.error();
    auto own = std::make_shared<Profile>(**read);
    own->uploaded = saved.uploaded();
    take_gate(saved, *own, warnings);
    return own;
}

}  // namespace gonio
