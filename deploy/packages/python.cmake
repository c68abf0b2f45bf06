# Installs the Python module, if it was built, in the folder where Debian's Python in /usr finds it.
if(OBLIQUE_PYTHON_MODULE)
  set(python_folder lib/python3/dist-packages/oblique)
  install(TARGETS oblique_python LIBRARY DESTINATION ${python_folder} COMPONENT python OPTIONAL)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/client/python/oblique/ DESTINATION ${python_folder} COMPONENT python
          FILES_MATCHING PATTERN "*.py" PATTERN "*.pyi" PATTERN "py.typed" PATTERN "__pycache__" EXCLUDE)
endif()
