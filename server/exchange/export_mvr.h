// A scene as it stands, as an MVR 1.6 show. Pure; any thread.
#pragma once

#include <string>

#include "server/exchange/export_glb.h"

namespace gonio::exchange {

// Result: the bytes of an .mvr that import_mvr() reads back as the same lights, rows of the patch and light. It has
// surfaces as GLB, and for each light a fixture with a GDTF and, beside it, its web at full level as LM-63. Level,
// master and colour are user data, since the standard has no word for them. Suns are left out, and of the patch all
// that is not level, red, green, blue, pan or tilt of one light. The same scene gives the same bytes. Errors: of
// export_glb(); those of write_zip().
Result<std::string> export_mvr(const Scene& scene, const Parts& each = {});

}  // namespace gonio::exchange
