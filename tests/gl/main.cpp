#include "tests/gl/test_context.h"

#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string_view>

namespace gonio::test {

static std::unique_ptr<gl::Context> the_context;

const gl::Context& context() {
    return *the_context;
}

static Renderer::DirectLight the_direct_light = Renderer::DirectLight::automatic;

Renderer::DirectLight direct_light() {
    return the_direct_light;
}

}  // namespace gonio::test

int main(int argc, char** argv) {
    testing::InitGoogleTest(&argc, argv);
    if (GTEST_FLAG_GET(list_tests)) return RUN_ALL_TESTS();
    for (int i = 1; i + 1 < argc; ++i) {
        if (std::string_view(argv[i]) != "--direct-light") continue;
        gonio::test::the_direct_light = std::string_view(argv[i + 1]) == "gl" ? gonio::Renderer::DirectLight::gl
                                                                              : gonio::Renderer::DirectLight::rays;
    }
    try {
        gonio::test::the_context = gonio::gl::Context::create({-1, true});
    } catch (const std::runtime_error& error) {
        std::fprintf(stderr, "%s\n", error.what());
        // Where EGL is known to be, a missing context is a failure; elsewhere the tier is skipped.
        return std::getenv("CI") != nullptr ? 1 : 77;
    }
    // As the renderer does, so that tests can tell what they look at.
    if (gonio::test::the_direct_light == gonio::Renderer::DirectLight::automatic)
        gonio::test::the_direct_light = gonio::test::the_context->software() ? gonio::Renderer::DirectLight::rays
                                                                             : gonio::Renderer::DirectLight::gl;
    const int result = RUN_ALL_TESTS();
    const int messages = gonio::test::context().debug_messages();
    if (messages > 0)
        std::fprintf(stderr, "%d GL debug messages, the last: %s\n", messages,
                     gonio::test::context().last_debug_message().c_str());
    gonio::test::the_context.reset();
    return messages > 0 ? 1 : result;
}
