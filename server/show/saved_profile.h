// Profiles as a show holds them. Pure; any thread.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "ies/core/result.h"
#include "protocol/schema/saved.pb.h"
#include "server/scene/profile.h"

namespace gonio {

inline constexpr std::size_t kMostGoboSlots = 255;     // of a wheel; further ones are left out
inline constexpr std::size_t kMostSavedGobo_px = 256;  // of each side

// Whether a profile is more than its name and its photometry: it has a wheel, or a picture is in its photometry.
bool has_gate(const Profile& profile);
// What it is more than these. Decodes all pictures of the wheel.
void put_gate(const Profile& profile, saved::Profile& saved);
// Result: SHA-256 of it, of the wheel's names and its pictures' files; decodes none. What comes back from a show has
// the same.
std::string gate_hash(const Profile& profile);
// Gives it to a profile. A slot whose picture is not whole is open, and a warning says so.
void take_gate(const saved::Profile& saved, Profile& profile, std::vector<std::string>& warnings);
// Result: the profile as it was saved. Errors: those of its photometry.
Result<std::shared_ptr<Profile>> restored_profile(const saved::Profile& saved, std::vector<std::string>& warnings);

}  // namespace gonio
