// Which profile a surface has: one that somebody gave it, or one that is shipped for its vendor and product. It may
// also be an input profile of QLC+ that bears the name that the surface gives itself.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "ies/core/result.h"
#include "protocol/surface/surface_profile.h"

namespace gonio {

class SurfaceProfiles {
public:
    // given: "vvvv:pppp" -> a .toml or .qxi file. Errors: of the reader, the file's name before the place; "not_found".
    static Result<SurfaceProfiles> load(const std::map<std::string, std::string>& given);
    // Result: the profile of a surface; an empty one (without a name) where there is none.
    SurfaceProfile find(const std::string& id, const std::string& product) const;
    // Result: every "vvvv:pppp" that has a profile: such surfaces are control surfaces.
    std::vector<std::string> ids() const;

private:
    std::map<std::string, SurfaceProfile> by_id_;
};

}  // namespace gonio
