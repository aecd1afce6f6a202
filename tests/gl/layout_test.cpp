// What C++ and GLSL share is checked against the programs' own introspection; every program the pipeline can ask for
// compiles.
#include <cstddef>
#include <string>

#include "server/gl/program.h"
#include "shaders/shared/layouts.h"
#include "tests/gl/test_context.h"

namespace gonio::test {
namespace {

GLint member_offset(GLuint program, const std::string& name) {
    const GLuint index = glGetProgramResourceIndex(program, GL_UNIFORM, name.c_str());
    EXPECT_NE(index, GL_INVALID_INDEX) << name;
    const GLenum property = GL_OFFSET;
    GLint offset = -1;
    glGetProgramResourceiv(program, GL_UNIFORM, index, 1, &property, 1, nullptr, &offset);
    return offset;
}

TEST(Layout, LightWeight) {
    const gl::Program program = gl::make_program("passes/screen.vert", "passes/composite.frag", {{"VIEW", "0"}});
    EXPECT_EQ(member_offset(program.id(), "weights[3].rgb"), static_cast<GLint>(3 * sizeof(layouts::LightWeight)));
}

// DrawInstance goes in by vertex attributes, whose offsets C++ takes from the struct itself; their locations are
// checked.
TEST(Layout, DrawInstanceAttributes) {
    const gl::Program program = gl::make_program("passes/mesh.vert", "passes/rsm.frag", {{"CUBE", "1"}});
    EXPECT_EQ(glGetAttribLocation(program.id(), "in_row0"), 3);
    EXPECT_EQ(glGetAttribLocation(program.id(), "in_row1"), 4);
    EXPECT_EQ(glGetAttribLocation(program.id(), "in_row2"), 5);
    EXPECT_EQ(glGetAttribLocation(program.id(), "in_face"), 6);
}

TEST(Programs, EveryOptionSetCompiles) {
    const auto make = [](const char* vertex, const char* fragment, const gl::Defines& defines) {
        EXPECT_NO_THROW(gl::make_program(vertex, fragment, defines)) << fragment;
    };
    for (int bits = 0; bits < 16; ++bits) {
        gl::Defines surface, cube = {{"CUBE", "1"}};
        if (bits & 1) surface.emplace_back("MASKED", "1"), cube.emplace_back("MASKED", "1");
        if (bits & 2) surface.emplace_back("TEXTURED", "1"), cube.emplace_back("TEXTURED", "1");
        if (bits & 4) surface.emplace_back("EMISSIVE", "1");
        if (bits & 8) surface.emplace_back("EMISSIVE_TEXTURED", "1"), cube.emplace_back("SEED", "1");
        make("passes/mesh.vert", "passes/gbuffer.frag", surface);
        make("passes/mesh.vert", "passes/rsm.frag", cube);
        make("passes/mesh.vert", (bits & 1) != 0 ? "passes/shadow.frag" : "", cube);
    }
    for (int view = 0; view < 10; ++view) {
        for (int bits = 0; bits < 4; ++bits) {
            gl::Defines defines = {{"VIEW", std::to_string(view)}};
            if (bits & 1) defines.emplace_back("RAW", "1");
            if (bits & 2) defines.emplace_back("EMISSIVE", "1");
            make("passes/screen.vert", "passes/composite.frag", defines);
        }
    }
    for (const char* sub : {"1", "2", "3"}) {
        make("passes/screen.vert", "passes/mask.frag", {{"CUBE", "1"}, {"SUB", sub}});
        make("passes/screen.vert", "passes/mask.frag", {{"CUBE", "1"}, {"SUB", sub}, {"UNIFORM_WEB", "1"}});
    }
    make("passes/screen.vert", "passes/direct.frag", {{"UNIFORM_WEB", "1"}});
    make("passes/screen.vert", "passes/flux.frag", {{"CUBE", "1"}});
    make("passes/screen.vert", "passes/direct.frag", {});
    make("passes/screen.vert", "passes/gather_seed.frag", {});
    make("passes/screen.vert", "passes/gather_seed.frag", {{"DISK", "1"}});
    make("passes/screen.vert", "passes/nv12.frag", {});
    make("passes/solid.vert", "passes/solid.frag", {});
}

}  // namespace
}  // namespace gonio::test
