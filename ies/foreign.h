// Files that are no photometry at all, called by their name: a web page, a picture, a plugin's file. Internal to ies/.
#pragma once

#include <optional>
#include <string_view>

#include "ies/core/result.h"

namespace gonio::ies::detail {

// bytes: a whole file that no reader takes. Result: what it is, where its first bytes tell; code not_photometry. It
// looks at 4 KiB.
std::optional<Error> foreign_file(std::string_view bytes);

}  // namespace gonio::ies::detail
