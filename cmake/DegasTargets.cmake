# Every .cpp of the named folders, but for a program's main.cpp.
function(degas_sources variable)
  set(sources)
  foreach(folder ${ARGN})
    file(GLOB found CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/${folder}/*.cpp)
    list(APPEND sources ${found})
  endforeach()
  list(FILTER sources EXCLUDE REGEX "/main\\.cpp$")
  set(${variable} ${sources} PARENT_SCOPE)
endfunction()

# One library per layer. Folders may still be empty of sources; then the library is header-only, so that the layers
# above can name it all the same.
function(degas_library name)
  degas_sources(sources ${ARGN})
  if(NOT sources)
    file(WRITE ${CMAKE_BINARY_DIR}/empty.cpp "")
    set(sources ${CMAKE_BINARY_DIR}/empty.cpp)
  endif()
  add_library(${name} STATIC ${sources})
  target_include_directories(${name} PUBLIC ${CMAKE_SOURCE_DIR})
endfunction()

# What a layer leaves open: objects that a program names beside its libraries.
function(degas_objects name)
  degas_sources(sources ${ARGN})
  add_library(${name} OBJECT ${sources})
endfunction()

# The program, placed at the top of the build folder; `pictures`: pictures_with_opencv or pictures_without_opencv.
function(degas_program name pictures)
  add_executable(${name} ${CMAKE_SOURCE_DIR}/model/cli/main.cpp)
  target_link_libraries(${name} PRIVATE degas_cli ${pictures})
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR})
endfunction()
