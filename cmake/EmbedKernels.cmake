# Embeds kernels/**/*.cl into a C++ source that fills embedded_kernels() (host/device/program.h), so that a
# program is one file. The build re-runs whenever a kernel changes.
function(degas_embed_kernels target folder)
  file(GLOB_RECURSE kernels CONFIGURE_DEPENDS ${folder}/*.cl)
  set(output ${CMAKE_BINARY_DIR}/embedded_kernels.cpp)
  add_custom_command(
    OUTPUT ${output}
    COMMAND ${CMAKE_COMMAND} -DOUTPUT=${output} -DFOLDER=${folder} -P ${CMAKE_SOURCE_DIR}/cmake/WriteEmbeddedKernels.cmake
    DEPENDS ${kernels} ${CMAKE_SOURCE_DIR}/cmake/WriteEmbeddedKernels.cmake
    VERBATIM)
  target_sources(${target} PRIVATE ${output})
endfunction()
