#include "client/web/page.h"

#include <string>
#include <vector>

#include "protocol/schema/property.h"

namespace gonio {

std::span<const EmbeddedFile> page_files() {
    static const std::string properties = properties_module();
    static const std::vector<EmbeddedFile> files = [] {
        const std::span<const EmbeddedFile> sources = page_sources();
        std::vector<EmbeddedFile> all(sources.begin(), sources.end());
        all.push_back({"properties.js", properties});
        return all;
    }();
    return files;
}

}  // namespace gonio
