# embed_files(TARGET SYMBOL BASE FILES…): compiles files into TARGET as
#   std::span<const gonio::EmbeddedFile> gonio::SYMBOL();      (cmake/embedded_file.h)
# with names relative to BASE. Content is a byte table, so any file may be embedded.
function(embed_files target symbol base)
    set(output ${CMAKE_CURRENT_BINARY_DIR}/${symbol}.cpp)
    add_custom_command(
        OUTPUT ${output}
        COMMAND ${CMAKE_COMMAND} -DOUTPUT=${output} -DSYMBOL=${symbol} -DBASE=${base} "-DFILES=${ARGN}"
                -P ${PROJECT_SOURCE_DIR}/cmake/embed_script.cmake
        DEPENDS ${ARGN} ${PROJECT_SOURCE_DIR}/cmake/embed_script.cmake
        VERBATIM)
    target_sources(${target} PRIVATE ${output})
endfunction()
