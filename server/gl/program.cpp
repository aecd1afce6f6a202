#include "server/gl/program.h"

#include <algorithm>
#include <sstream>
#include <stdexcept>

#include "shaders/shaders.h"

namespace gonio::gl {
namespace {

std::string_view embedded(std::string_view name) {
    for (const EmbeddedFile& file : shader_files()) {
        if (file.name == name) return file.content;
    }
    throw ProgramError("there is no shader file '" + std::string(name) + "'");
}

// names: the files so far; one that is among them is left out.
void append(std::string_view name, std::vector<std::string>& names, std::string& out) {
    if (std::find(names.begin(), names.end(), name) != names.end()) return;
    const int index = static_cast<int>(names.size());
    names.emplace_back(name);
    std::istringstream lines{std::string(embedded(name))};
    std::string line;
    int number = 0;
    out += "#line 1 " + std::to_string(index) + "\n";
    while (std::getline(lines, line)) {
        ++number;
        const std::string_view prefix = "#include \"";
        if (line.rfind(prefix, 0) == 0) {
            const std::size_t end = line.find('"', prefix.size());
            append(line.substr(prefix.size(), end - prefix.size()), names, out);
            out += "#line " + std::to_string(number + 1) + " " + std::to_string(index) + "\n";
        } else {
            out += line + "\n";
        }
    }
}

std::string source(std::string_view name, const Defines& defines, std::vector<std::string>& names) {
    std::string text = "#version 450 core\n";
    if (name.ends_with(".vert")) text += "#extension GL_ARB_shader_viewport_layer_array : require\n";
    for (const auto& [key, value] : defines) text += "#define " + key + " " + value + "\n";
    append(name, names, text);
    return text;
}

GLuint compile(GLenum stage, std::string_view name, const Defines& defines) {
    std::vector<std::string> names;
    const std::string text = source(name, defines, names);
    const GLuint shader = glCreateShader(stage);
    const char* pointer = text.c_str();
    glShaderSource(shader, 1, &pointer, nullptr);
    glCompileShader(shader);
    GLint ok = 0;
    glGetShaderiv(shader, GL_COMPILE_STATUS, &ok);
    if (!ok) {
        char log[4096] = {};
        glGetShaderInfoLog(shader, sizeof log, nullptr, log);
        glDeleteShader(shader);
        std::string files;
        for (std::size_t i = 0; i < names.size(); ++i) files += " " + std::to_string(i) + "=" + names[i];
        throw ProgramError("shader does not compile;" + files + ":\n" + log);
    }
    return shader;
}

}  // namespace

Program make_program(std::string_view vertex, std::string_view fragment, const Defines& defines) {
    Program program(glCreateProgram());
    for (const auto& [stage, name] : {std::pair(GL_VERTEX_SHADER, vertex), std::pair(GL_FRAGMENT_SHADER, fragment)}) {
        if (name.empty()) continue;
        const GLuint shader = compile(stage, name, defines);
        glAttachShader(program.id(), shader);
        glDeleteShader(shader);  // with the program
    }
    glLinkProgram(program.id());
    GLint ok = 0;
    glGetProgramiv(program.id(), GL_LINK_STATUS, &ok);
    if (!ok) {
        char log[4096] = {};
        glGetProgramInfoLog(program.id(), sizeof log, nullptr, log);
        throw ProgramError("shader program " + std::string(vertex) + " + " + std::string(fragment) +
                           " does not link:\n" + log);
    }
    const std::string label = std::string(fragment.empty() ? vertex : fragment);
    glObjectLabel(GL_PROGRAM, program.id(), static_cast<GLsizei>(label.size()), label.data());
    return program;
}

}  // namespace gonio::gl
