// A file that is one luminaire, photometric or GDTF -> the profile that lights share. Any thread.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "ies/core/result.h"
#include "server/scene/profile.h"

namespace gonio::exchange {

// Result: as make_profile() reads it; of a GDTF fixture the first beam of its first mode, with its gobos. Errors: of
// make_profile(), "invalid_gdtf" with the import's first warning.
Result<std::shared_ptr<const Profile>> read_luminaire(std::string name, std::string_view bytes);

}  // namespace gonio::exchange
