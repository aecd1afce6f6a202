// Any bytes into the EULUMDAT reader: a web that keeps its promises, or an error with a code and a place.
#include "tests/fuzz/ies_fuzz_check.h"

#include "ies/eulumdat.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    gonio::ies::fuzz::check(gonio::ies::read_eulumdat(text));
    return 0;
}
